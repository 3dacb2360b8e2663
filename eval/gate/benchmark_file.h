#pragma once

// Results of Google Benchmark (--benchmark_format=json or --benchmark_out). Every repetition is a sample;
// aggregates (mean, median, ..) are used only if the file holds nothing else.

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

struct BenchmarkFile {
  std::string path;
  Json context;
  /// By name of the benchmark; samples in the order of the file
  std::map<std::string, std::vector<double>> cpu_ns;
  std::map<std::string, std::vector<double>> real_ns;  ///< with the same names
};

/// Parses a file; throws Error "NAME: ..." on anything that is not such a file, on a benchmark that failed,
/// and on a time that is not a number above 0.
BenchmarkFile parse_benchmark_file(std::string_view text, const std::string& name);

}  // namespace sextant
