#pragma once

// Estimators "external:CONFIG.json": an external program, run once per case on files with the noise of the
// case. Its results become records like those of built-in estimators, with the same truth, metrics and bound
// (docs/external-estimators.md). The status follows from the results only, however the program ended:
//
//   a pose, or motion, exists      ok, or no_truth
//   it does not exist              lost; not_detected for an object that the results never name
//   the results cannot be read     diverged
//
// Exit code, time-out and every problem are reported (PairEstimator::problems()) and written to the case's
// log.txt.

#include <filesystem>
#include <string>

#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/external/external_config.h"

namespace sextant {

/// Opens an estimator. Throws Error on an invalid configuration.
std::shared_ptr<const CaseEstimator> open_external_estimator(const std::string& config,
                                                             const Json& overrides);

/// Adds the kind "external:CONFIG.json" to make_case_estimator(); further calls do nothing.
void add_external_estimators();

// ---- Rescoring: the files that external programs left in the folder of a finished run or sweep are
// evaluated again, without running the programs: after a mistake in the reading of results, or with another
// definition. The folder is only read.

struct RescoreRequest {
  std::filesystem::path folder;  ///< folder of the finished run or sweep
  std::string config;  ///< configuration that replaces the recorded one; empty: use the recorded one
  Json options = Json::object();  ///< changes of the recorded tree: "estimator", "pipeline", ...
  std::string data_root;          ///< for relative paths of sources
};

/// Returns true for the folder of a sweep, false for that of a run. Throws Error if it is neither.
bool is_sweep(const std::filesystem::path& folder);

/// Returns the argument for run(). Throws Error if the folder is not that of a finished run, or if its
/// estimator is not an external program. The outputs themselves are read by run().
RunConfig rescored_run(const RescoreRequest& request);
/// Returns the argument for sweep(), without `out`; built-in estimators are run again. Throws Error if the
/// folder has no plan.json of a sweep, if none of its estimators is an external program, or if several are
/// and the request has a configuration, which is for one.
SweepConfig rescored_sweep(const RescoreRequest& request);

}  // namespace sextant
