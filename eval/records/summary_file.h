#pragma once

// summary.bin, beside run.json what a sweep with "keep": "summary" leaves instead of records.jsonl:
//
//   {"sextant":"case summaries","schema":1,"cases":12,"errors":["Et_m","ER_deg"]}   a line of JSON
//   per case, in order of number
//     varint number | varint n | n bytes, encode_case_summary() | the first 8 hexadecimal digits of their SHA-256
//   varint n | n bytes, the sums of the noise of all cases, for whoever makes them | 8 digits of their SHA-256
//
// `errors` are the compared errors in the order of the blocks. A case's bytes depend on the case alone, so that shards
// merge to the file of a whole sweep. varint: base/byte_stream.h.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "sextant/base/files.h"
#include "sextant/eval/records/case_summary.h"

namespace sextant {

inline constexpr const char* summary_file_name = "summary.bin";

/// Whether a folder holds the results of a run or a sweep: records.jsonl or summary.bin.
bool has_results(const std::filesystem::path& folder);
/// Throws Error where `records`, a file of records, is not there but a summary is.
void check_keeps_records(const std::filesystem::path& records);

class SummaryWriter {
 public:
  SummaryWriter(const std::filesystem::path& path, uint64_t n_cases);
  /// Cases come in order of number.
  void append(uint64_t number, std::string_view bytes);
  void close(std::string_view noise);

 private:
  StreamedFile file_;
};

/// From the first case to the last. Throws Error that names file and case when the file is none, was cut off or
/// damaged, or holds errors that this program does not compare.
class SummaryReader {
 public:
  explicit SummaryReader(const std::filesystem::path& path);

  uint64_t n_cases() const { return n_cases_; }

  struct Block {
    uint64_t number = 0;
    std::string bytes;
  };
  /// Numbers rise; nothing after the last, when noise() is there.
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

/// Every case of a file, in order.
void for_each_summary(const std::filesystem::path& path, const std::function<void(const CaseSummary&)>& visit);

}  // namespace sextant
