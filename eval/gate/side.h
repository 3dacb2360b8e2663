#pragma once

// One side of a comparison. A path may be
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

/// Results of one folder.
struct RunFolder {
  std::string path;
  std::vector<SubjectCases> subjects;  ///< in the order of compare_subjects()
  size_t n_cases = 0;
  bool has_times = false;
  Json provenance;  ///< run.json; null if there is none
};

/// All results on one side; several runs are repetitions.
struct Side {
  std::string path;
  std::vector<RunFolder> runs;
  std::vector<BenchmarkFile> benchmarks;
};

/// Reads one side, streaming the records. Throws Error on a path without results, an empty or damaged file,
/// an unfinished sweep, and on a case that occurs twice.
Side read_side(const std::filesystem::path& path);

/// Returns true for files named benchmark*.json.
bool is_benchmark_file(const std::filesystem::directory_entry& entry);

// ---- A baseline is the result of a run that is kept in the repository to compare with: run.json, and
// records.jsonl without times. Times belong to a machine; speed is compared as a pair of measurements
// (scripts/bench_pair).

/// Returns the files that make the results in `run` a baseline. Throws Error on bad results and on more than
/// one run.
OutputFiles baseline_files(const std::filesystem::path& run);

}  // namespace sextant
