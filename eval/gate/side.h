#pragma once

// One side of a comparison. A path is
//   a folder of `sextant run` or `sextant sweep` (records.jsonl, run.json), also with benchmark*.json in it,
//   a JSON file of Google Benchmark, or a folder with benchmark*.json files,
//   a folder of such folders: repetitions, in order of their names.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/gate/benchmark_file.h"
#include "sextant/eval/records/record.h"

namespace sextant {

/// Records in order of case, and the indices at which a new subject begins. A subject is what is judged as
/// one: dataset, sequence, estimator, noise, level and body.
struct RunFolder {
  std::string path;
  std::vector<Record> records;
  Json provenance;  ///< run.json; null when there is none
};

struct Side {
  std::string path;
  std::vector<RunFolder> runs;
  std::vector<BenchmarkFile> benchmarks;
};

/// Order of subjects and cases: < 0, 0, > 0.
int compare_subjects(const Record& a, const Record& b);
int compare_cases(const Record& a, const Record& b);

/// Throws Error on a path without results, an empty or damaged file, an unfinished sweep, a case twice.
Side read_side(const std::filesystem::path& path);

}  // namespace sextant
