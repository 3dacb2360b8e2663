#pragma once

// Summary of a case for sweeps with "keep": "summary" (one source, estimator, noise level and seed): counts,
// sums and histograms of its records, body by body. Since all intervals cluster by seed, means, RMSE,
// coverage, trends and their intervals are the same as from the records; quantiles agree to 0.5 %.
//
// The summary covers the records with status ok and truth ("estimated"):
//   errors      of each `compared` error (metrics/definitions.h): n, sum, sum of squares, histogram
//   limits      of each error with a CRLB, over the records that have error and bound: n, the bound's sum of
//               squares, the error's sums
//   nees, epe_initial_px (if true flow is given), distance_gt_m (if Et_m exists): n and sum

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/eval/records/record.h"
#include "sextant/stats/summary.h"

namespace sextant {

struct MeanSums {
  uint64_t n = 0;
  double sum = 0;
  void add(double value) {
    ++n;
    sum += value;
  }
  bool operator==(const MeanSums&) const = default;
};

struct LimitSums {
  uint64_t n = 0;
  double bound_squares = 0;
  double error_sum = 0;
  double error_squares = 0;
  bool operator==(const LimitSums&) const = default;
};

/// Sums of one body of a case.
struct BodySums {
  int body = 0;  ///< 0: ego, otherwise the object's id
  std::map<std::pair<Status, Gate>, uint64_t> statuses;
  uint64_t n_estimated = 0;  ///< number of records with status ok and truth
  std::vector<int> missed;   ///< frames with truth but without estimate; ascending
  std::map<std::string, SampleSums> errors;
  std::map<std::string, LimitSums> limits;  ///< by name of the error
  MeanSums nees, epe_initial_px, distance_gt_m;

  uint64_t n_records() const;
  uint64_t n_truth() const { return n_estimated + missed.size(); }
  bool operator==(const BodySums&) const = default;
};

/// Sums of one result of the case's estimator; an external program may have several results.
struct ResultSums {
  std::string estimator;         ///< name as in records
  std::vector<BodySums> bodies;  ///< ordered by body
  bool operator==(const ResultSums&) const = default;
};

struct CaseSummary {
  std::string dataset, sequence, noise;
  double level = 0;
  uint64_t seed = 0;
  std::vector<ResultSums> results;

  uint64_t n_records() const;
  bool operator==(const CaseSummary&) const = default;
};

/// Summarises the records of one case.
CaseSummary summarize_case(const std::vector<Record>& records);

std::string encode_case_summary(const CaseSummary& summary);
/// Decodes a summary. Throws Error that begins with `where` if the bytes are invalid.
CaseSummary decode_case_summary(std::string_view bytes, const std::string& where);

// ---- summary.bin, which a sweep with "keep": "summary" writes next to run.json instead of records.jsonl:
//
//   {"sextant":"case summaries","schema":1,"cases":12,"errors":["Et_m","ER_deg"]}   a line of JSON
//   per case, in order of number
//     varint number | varint n | n bytes, encode_case_summary() | first 8 hexadecimal digits of their SHA-256
//   varint n | n bytes, the noise verification of all cases, opaque here | 8 digits of their SHA-256
//
// `errors` are the compared errors in the order of the blocks. The bytes of a case depend on the case only,
// so that merged shards give the file of the whole sweep. varint: base/byte_stream.h.

inline constexpr const char* summary_file_name = "summary.bin";

/// Returns true if a folder contains the results of a run or a sweep: records.jsonl or summary.bin.
bool has_results(const std::filesystem::path& folder);
/// Throws Error if the file `records` does not exist but a summary does.
void check_keeps_records(const std::filesystem::path& records);

class SummaryWriter {
 public:
  SummaryWriter(const std::filesystem::path& path, uint64_t n_cases);
  /// Appends the bytes of encode_case_summary(). Cases must be appended in order of number.
  void append(uint64_t number, std::string_view bytes);
  /// Appends the noise of all cases, and completes the file.
  void close(std::string_view noise);

 private:
  StreamedFile file_;
};

/// Reads a summary file from the first case to the last. Throws Error with file and case if it is not a
/// summary file, is truncated or damaged, or sums up other errors than those that this program compares.
class SummaryReader {
 public:
  explicit SummaryReader(const std::filesystem::path& path);

  uint64_t n_cases() const { return n_cases_; }

  struct Block {
    uint64_t number = 0;
    std::string bytes;
  };
  /// Returns the next case, in ascending order of number; nullopt after the last one, when noise() is
  /// available.
  std::optional<Block> next();
  const std::string& noise() const { return noise_; }

 private:
  uint64_t varint();
  std::string take(uint64_t n);
  std::string checked(const std::string& what);
  [[noreturn]] void cut_off() const;

  std::string name_;
  std::ifstream file_;
  uint64_t left_bytes_ = 0;
  uint64_t n_cases_ = 0, n_read_ = 0;
  std::optional<uint64_t> last_;
  std::string noise_;
  bool is_at_end_ = false;
};

/// Visits every case of a file, in order.
void for_each_summary(const std::filesystem::path& path,
                      const std::function<void(const CaseSummary&)>& visit);

}  // namespace sextant
