#pragma once

// One side of a comparison. A path is
//   a folder of `sextant run` or `sextant sweep` (records.jsonl, run.json), also with benchmark*.json in it,
//   a JSON file of Google Benchmark, or a folder with benchmark*.json files,
//   a folder of such folders: repetitions, in order of their names.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/gate/benchmark_file.h"
#include "sextant/eval/gate/subject_cases.h"
#include "sextant/eval/records/output.h"

namespace sextant {

struct RunFolder {
  std::string path;
  std::vector<SubjectCases> subjects;  ///< in order
  size_t n_cases = 0;
  bool has_times = false;
  Json provenance;  ///< run.json; null when there is none
};

struct Side {
  std::string path;
  std::vector<RunFolder> runs;
  std::vector<BenchmarkFile> benchmarks;
};

/// Streams the records. Throws Error on a path without results, an empty or damaged file, an unfinished sweep, a case twice.
Side read_side(const std::filesystem::path& path);

/// benchmark*.json
bool is_benchmark_file(const std::filesystem::directory_entry& entry);

// ---- a baseline is the result of a run that is kept in the repository and compared with: records.jsonl without
// times (those belong to a machine; speed is compared as a pair, scripts/bench_pair) and run.json.

/// The files that make the results in `run` a baseline. Throws Error on bad results and on more than one run.
OutputFiles baseline_files(const std::filesystem::path& run);

}  // namespace sextant
