#pragma once

// Runs and sweeps from what a user asks for to the folder of results: the commands `run` and `rescore` and
// the Python functions run() and sweep() call these and print what they return.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/external/rescore.h"

namespace sextant {

/// The noise of RunRequest::procedure, in place of JSON.
inline constexpr const char* noise_of_procedure = "procedure";

/// A run in the words of its user.
struct RunRequest {
  std::vector<std::string> sources;  ///< SOURCE each; relative paths lie below data_root
  std::string data_root;
  std::string estimator = RunConfig{}.estimator;
  std::string procedure;          ///< its options go below `options`; empty: none
  Json options = Json::object();  ///< strict tree (run_options.h); "noise" in it goes on top of `noise`
  std::string noise = "none";     ///< JSON, "none" or "procedure"
  bool consistency = false;       ///< halves of every body's points are estimated as well
  double level = 0;
  int n_seeds = RunConfig{}.n_seeds;
  int jobs = 1;
  bool quiet = false;  ///< no progress line
};

/// The folder of a run.
struct RunOutput {
  std::string out;
  std::string preset = "paper";  ///< of the summary's errors
  std::string data_root;         ///< for the commands in report.html; empty where the environment says it
  bool force = false;            ///< results of another run in the folder are replaced
};

/// Throws Error on sources, options, noise or procedures that do not exist.
RunConfig run_config(const RunRequest& request, const RunOutput& output);

struct WrittenRun {
  RunResult result;
  std::vector<std::string> warnings;  ///< of the folder: why it has no report.html
};

/// Runs and writes the folder: run_files(), summary.md, summary.csv and report.html. A run that was
/// interrupted goes on after the sources that it has done. Throws Error and Interrupted as run() does, and
/// Error where the folder holds another run.
WrittenRun run_into_folder(const RunConfig& config, const RunOutput& output);

/// One of the two.
struct RescoredFolder {
  std::optional<WrittenRun> run;
  std::optional<SweepOutcome> sweep;
};
/// Scores again what external programs left in the folder of a run or of a sweep, into another folder.
/// `config` gives jobs, progress, packs and where lines for the user go; the rest of it comes from the
/// folder.
RescoredFolder rescore_into_folder(const RescoreRequest& request, const SweepConfig& config,
                                   const RunOutput& output);

}  // namespace sextant
