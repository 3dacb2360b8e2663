#pragma once

// Reports, from a user's request to the folder that holds them. The commands `evaluate ego`, `evaluate
// objects` and `reproduce` call these and print what they return. An output folder is locked before
// anything is read.

#include <span>
#include <string>

#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/reproduce/reproduce.h"

namespace sextant {

/// Files and folders to write the results of trajectories to; empty: not written.
struct EgoOutput {
  std::string zip;  ///< FILE in evo's result format, for one estimate
  std::string tum;  ///< DIR for the matched, aligned trajectories in TUM format
  std::string out;  ///< DIR for report.html, tables, figures and every pose of every curve
  ViewPlane plane = ViewPlane::extent;  ///< plane of the paths seen from above
};
/// Evaluates camera trajectories and writes the outputs requested in `output`. Throws Error on bad files.
EgoScores evaluate_ego_into(const EgoFiles& files, const EgoOptions& options, const EgoOutput& output);

/// Evaluates logs of objects. `out`: DIR for report.html, tables, figures and records.jsonl; empty: not
/// written. Throws Error on bad files.
ObjectScores evaluate_objects_into(const ObjectFiles& files, std::span<const MetricPreset> presets,
                                   const std::string& out);

/// Runs the unfinished experiments of a reproduction (none with `report_only`) and writes its report into
/// config.out/report. Throws Error on bad data and Interrupted on Ctrl-C, after which the same call
/// resumes.
struct Reproduction {
  ReportDocument document;
  std::vector<PaperLayout> tables;  ///< tables in the layout of the paper
  std::filesystem::path report;     ///< report.html
};
Reproduction reproduce(const ReproduceConfig& config, bool report_only);

}  // namespace sextant
