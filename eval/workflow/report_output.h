#pragma once

// Makes reports, from a user's request to the folder that contains them. The commands `evaluate ego`,
// `evaluate objects`, `reproduce` and `report` call these functions and print what they return. An output
// folder is locked before anything is read.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/report/html/html.h"
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

// ---- The report of `sextant report`: statements of the paper, errors by noise level and their growth,
// comparisons of estimators, and the noise that was achieved.

/// Makes the report of runs and sweeps together. It has no sections if no pair has truth. `out`: folder of
/// the report, from which rows of tables link to records; empty: no links. Throws Error on bad folders.
ReportDocument noise_document(const std::vector<std::filesystem::path>& folders, int jobs, bool quiet = true,
                              const std::filesystem::path& out = {});

/// Makes the report and writes it as a report folder into `out`, unless `out` is empty. Throws Error on bad
/// folders and if no pair has truth.
ReportDocument report_sweeps(const std::vector<std::filesystem::path>& folders,
                             const std::filesystem::path& out, const ReportFolderOptions& options);

}  // namespace sextant
