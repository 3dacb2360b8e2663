#pragma once

// Scoring again what external programs left in the folder of a finished run or sweep, without running them:
// after a mistake in how results are read, or with another definition. The folder is only read.

#include <filesystem>
#include <string>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"

namespace sextant {

struct RescoreRequest {
  std::filesystem::path folder;   ///< of the finished run or sweep
  std::string config;             ///< configuration in place of the recorded one; empty: that one
  Json options = Json::object();  ///< laid over the recorded tree: "estimator", "pipeline", ...
  std::string data_root;          ///< for relative paths of sources
};

/// Whether the folder holds a sweep rather than a run. Throws Error when it holds neither.
bool is_sweep(const std::filesystem::path& folder);

/// What run() is to be given. Throws Error on a folder without outputs of an external program.
RunConfig rescored_run(const RescoreRequest& request);
/// What sweep() is to be given, `out` apart; estimators inside are run again. Likewise.
SweepConfig rescored_sweep(const RescoreRequest& request);

}  // namespace sextant
