#pragma once

// A baseline is the result of a run that is kept in the repository and compared with: records.jsonl without
// times (those belong to a machine; speed is compared as a pair, scripts/bench_pair) and run.json.

#include <filesystem>

#include "sextant/eval/records/output.h"

namespace sextant {

/// The files that make the results in `run` a baseline. Throws Error on bad results and on more than one run.
OutputFiles baseline_files(const std::filesystem::path& run);

}  // namespace sextant
