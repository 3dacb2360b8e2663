#pragma once

// One side of a comparison. A path may be
//   a folder of `sextant run` or `sextant sweep` (records.jsonl, run.json), also with benchmark*.json in it,
//   a JSON file of Google Benchmark, or a folder with benchmark*.json files,
//   a folder of such folders: repetitions, in order of their names.

#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/subject_cases.h"
#include "sextant/eval/records/output.h"

namespace sextant {

// ---- Results of Google Benchmark (--benchmark_format=json or --benchmark_out). Every repetition is a
// sample. Aggregates (mean, median, ..) are ignored, except for a benchmark without repetitions in the file:
// its median is its only sample.

struct BenchmarkFile {
  std::string path;
  Json context;
  /// By name of the benchmark; samples in the order of the file
  std::map<std::string, std::vector<double>> cpu_ns;
  std::map<std::string, std::vector<double>> real_ns;  ///< with the same names

  /// Returns true if the time of this benchmark is its real time: `time` is real, or the name of the
  /// benchmark requests it ("/real_time" or "/manual_time"). Otherwise its time is the CPU time.
  static bool measures_real_time(const std::string& benchmark, BenchmarkTime time);
  /// Returns the times of benchmarks by name, of the kind that measures_real_time() says.
  std::map<std::string, std::vector<double>> times_ns(BenchmarkTime time) const;
};

/// Parses a file. Throws Error "NAME: ..." on anything that is not such a file, on a benchmark that failed,
/// and on a time that is neither 0 nor in the range of 1e-100 to 1e100.
BenchmarkFile parse_benchmark_file(std::string_view text, const std::string& name);

/// Results of one folder.
struct RunFolder {
  std::string path;
  Subjects subjects;
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

/// Reads one side, streaming the records. Throws Error on a path without results, on the path of a
/// records.jsonl instead of its folder, on an empty or damaged file, on an unfinished sweep, and on a record
/// that occurs twice.
Side read_side(const std::filesystem::path& path);

/// Returns true for regular files named benchmark*.json.
bool is_benchmark_file(const std::filesystem::directory_entry& entry);

// ---- A baseline is the result of a run that is kept in the repository to compare with: run.json, and
// records.jsonl without times. Times belong to a machine; speed is compared as a pair of measurements
// (scripts/bench_pair).

/// Returns the files that make the results in `run` a baseline. Throws Error on bad results, and if `run`
/// does not contain exactly one run.
OutputFiles baseline_files(const std::filesystem::path& run);

// ---- Checks that two sides are comparable: same data, definitions, configuration and machine, and the same
// records. Differences that the policy accepts are reported as well. The first five differences of a kind are
// listed, and further ones are counted.

/// A difference between the two sides.
struct Mismatch {
  /// Key of SamenessPolicy, "input", or a note: "build", "program" (fingerprints), "same program", "records"
  /// (fewer or more than run.json states), "repetitions", "measurements" and "covariances" (record_pairs.h),
  /// "times" (not judged, because a side has none)
  std::string what;
  std::string subject;
  std::string base;   ///< value in BASE
  std::string fresh;  ///< value in NEW
  bool invalidates = true;
};

/// Compares the provenance of the two sides: run.json, and the context of benchmark files. Missing records
/// are found where records are paired (record_pairs.h, speed.h).
std::vector<Mismatch> compare_provenance(const Side& base, const Side& fresh, const Policy& policy);

/// Reports the noises and levels that only one side has, of bodies that both sides have: the reason why
/// records are missing or new.
void report_noises(const Subjects& base, const Subjects& fresh, Strictness rule,
                   std::vector<Mismatch>& findings);

/// Makes a mismatch that invalidates the comparison if the rule is Strictness::must.
Mismatch mismatch(Strictness rule, std::string what, std::string subject, std::string base,
                  std::string fresh);

/// Collects findings of one kind, and lists only the first few of them individually.
class Tally {
 public:
  Tally(std::string what, Strictness rule) : what_(std::move(what)), rule_(rule) {}

  void add(const std::string& subject, const std::string& base, const std::string& fresh) {
    if (n_++ < shown) findings_.push_back(mismatch(rule_, what_, subject, base, fresh));
  }

  /// Moves the findings listed so far to `all`.
  void move_findings(std::vector<Mismatch>& all) {
    std::ranges::move(std::exchange(findings_, {}), std::back_inserter(all));
  }

  /// Moves the listed findings to `all`, with one more that states the number of findings not listed.
  void move_to(std::vector<Mismatch>& all) {
    if (n_ > shown) findings_.push_back(mismatch(rule_, what_, fmt::format("{} more", n_ - shown), "", ""));
    move_findings(all);
  }

 private:
  static constexpr size_t shown = 5;
  std::string what_;
  Strictness rule_;
  std::vector<Mismatch> findings_;
  size_t n_ = 0;
};

}  // namespace sextant
