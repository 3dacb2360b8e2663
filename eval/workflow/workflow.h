#pragma once

// Entry points of the command line and of the Python package: from a user's request to the folder of its
// results. They return what the callers print. An output folder is locked before anything is read.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/external/external_estimator.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/reproduce/reproduce.h"

namespace sextant {

// ---- Runs and sweeps: the commands `run` and `rescore`, and the Python functions run() and sweep().

/// Value of RunRequest::noise that stands for the noise of RunRequest::procedure.
inline constexpr const char* noise_of_procedure = "procedure";

/// A run as a user requests it, with texts instead of parsed values.
struct RunRequest {
  std::vector<std::string> sources;  ///< SOURCE each; relative paths lie below data_root
  std::string data_root;
  std::string estimator = RunConfig{}.estimator;
  std::string procedure;          ///< its options apply first, then `options`; empty: none
  Json options = Json::object();  ///< strict tree (run.h); "noise" in it is merged over `noise`
  std::string noise = "none";     ///< JSON, "none" or "procedure"
  bool consistency = false;       ///< also estimates every body from each half of its points (split_nees)
  double level = 0;
  int n_seeds = RunConfig{}.n_seeds;
  int jobs = 1;
  bool quiet = false;  ///< no progress line
};

/// Output folder of a run.
struct RunOutput {
  std::string out;
  std::string preset = "paper";  ///< metric preset of the summary
  std::string data_root;         ///< for the commands in report.html; empty if $SEXTANT_DATA gives it
  bool force = false;            ///< results of another run in the folder are replaced
};

/// Builds the configuration; throws Error on unknown sources, options, noise or procedures.
RunConfig run_config(const RunRequest& request, const RunOutput& output);

/// Returns sentences about noise that was given and changes nothing, and about levels and seeds without
/// noise.
std::vector<std::string> noise_warnings(const RunRequest& request, const RunConfig& config);

/// A finished run and the warnings about its folder.
struct WrittenRun {
  RunResult result;
  std::vector<std::string> warnings;  ///< e.g. why the folder has no report.html
};

/// Runs and writes the folder: run_files(), summary.md, summary.csv and report.html. An interrupted run is
/// resumed after its last finished source. If the estimate of a source contradicts its truth, the failed
/// checks of the source (check_source.h) are added to SourceRun::problems. Throws Error and Interrupted as
/// run() does, and Error if the folder contains the results of another run and output.force is off.
WrittenRun run_into_folder(const RunConfig& config, const RunOutput& output);

/// Result of rescoring: exactly one member is set.
struct RescoredFolder {
  std::optional<WrittenRun> run;
  std::optional<SweepOutcome> sweep;
};
/// Scores again the files that external programs left in the folder of a run or sweep, and writes the
/// results into another folder. `config` supplies only the number of jobs, `quiet` and, for a sweep, the
/// correspondence cache and the receiver of notes for the user; everything else comes from the folder, the
/// request and `output`.
RescoredFolder rescore_into_folder(const RescoreRequest& request, const SweepConfig& config,
                                   const RunOutput& output);

// ---- Reports: the commands `evaluate ego`, `evaluate objects`, `reproduce` and `report`.

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
