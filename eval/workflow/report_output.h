#pragma once

// Reports from what a user asks for to the folder that holds them: the commands `evaluate ego`, `evaluate
// objects` and `reproduce` call these and print what they return. An output folder is locked before anything
// is read.

#include <span>
#include <string>

#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/reproduce/reproduce.h"

namespace sextant {

/// Where the results of trajectories go besides the return value; empty: nowhere.
struct EgoOutput {
  std::string zip;  ///< FILE as evo writes it, of one estimate
  std::string tum;  ///< DIR for the matched, aligned trajectories
  std::string out;  ///< DIR for report.html, tables, figures and every pose of every curve
  ViewPlane plane = ViewPlane::extent;  ///< of the paths from above
};
/// Throws Error on bad files.
EgoScores evaluate_ego_into(const EgoFiles& files, const EgoOptions& options, const EgoOutput& output);

/// `out`: DIR for report.html, tables, figures and records.jsonl; empty: none. Throws Error on bad files.
ObjectScores evaluate_objects_into(const ObjectFiles& files, std::span<const MetricPreset> presets,
                                   const std::string& out);

/// Runs the parts of a reproduction that are not finished (none with `report_only`) and writes its report
/// into config.out/report. Throws Error on bad data, Interrupted on Ctrl-C: the same call resumes.
struct Reproduction {
  ReportDocument document;
  std::vector<PaperLayout> tables;  ///< as the paper prints them
  std::filesystem::path report;     ///< report.html
};
Reproduction reproduce(const ReproduceConfig& config, bool report_only);

}  // namespace sextant
