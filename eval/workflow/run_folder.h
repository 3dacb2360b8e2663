#pragma once

// Runs and sweeps, from a user's request to the folder of results. The commands `run` and `rescore` and the
// Python functions run() and sweep() call these and print what they return.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/external/rescore.h"

namespace sextant {

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

/// A finished run and the warnings about its folder.
struct WrittenRun {
  RunResult result;
  std::vector<std::string> warnings;  ///< e.g. why the folder has no report.html
};

/// Runs and writes the folder: run_files(), summary.md, summary.csv and report.html. An interrupted run is
/// resumed after its last finished source. Throws Error and Interrupted as run() does, and Error if the
/// folder contains the results of another run and output.force is off.
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

}  // namespace sextant
