#pragma once

// Streams a text file of numbers, one record per line: any size, a few MB of memory, about 25 ns a number.
//
//   NumberFile file(path, ' ');
//   while (file.next()) series.add(file.values()[1], ...);
//
// Accepts CRLF, a UTF-8 byte order mark, blanks at either end, empty lines, and comments that begin with '#'.
// A file whose first record does not begin with a number has a header there, which header() gives. Every
// other field must be a finite number in C notation; all messages start "PATH:LINE: " and say what to do.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {

/// What a reader takes of a file that may be too large or unfinished.
struct ReadRules {
  uint64_t most_bytes = std::numeric_limits<uint64_t>::max();  ///< an Error before anything is read
  bool whole_lines = false;  ///< a last line without its end, which may hold half a number, is left out
};

/// Throws Error when the file is larger than the rules allow.
void check_size(const std::string& path, uint64_t bytes, const ReadRules& rules);

class NumberFile {
 public:
  /// A separator that the first record decides: a comma where it has one, else blanks.
  static constexpr char kEither = '\0';

  /// `separator` ' ': runs of blanks and tabs; any other: exactly one between fields, which are trimmed.
  /// Throws Error when the file cannot be read.
  NumberFile(std::string path, char separator, const ReadRules& rules = {});
  ~NumberFile();
  NumberFile(const NumberFile&) = delete;
  NumberFile& operator=(const NumberFile&) = delete;

  /// Steps to the next record; false at the end. Throws Error on what is no finite number.
  bool next();

  std::span<const double> values() const { return values_; }
  int64_t line() const { return line_; }   ///< 1 for the first of the file
  bool is_cut() const { return is_cut_; }  ///< at the end: the last line was left out
  /// About how many records the file has, judged by the first; at most 2^20, as later ones may be longer.
  size_t expected_records() const { return std::min(file_bytes_ / (line_bytes_ + 1) + 16, size_t{1} << 20); }
  const std::string& path() const { return path_; }
  const std::string& header() const { return header_; }      ///< without blanks at the ends; may be empty
  const std::string& comments() const { return comments_; }  ///< of the first lines, at most 4 kB
  /// The header, else the last comment before the first record: where the columns have names, they are here.
  const std::string& column_names() const { return header_.empty() ? last_comment_ : header_; }
  char separator() const { return separator_; }

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    fail("{}:{}: {}", path_, line_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  bool next_line(std::string_view& line);
  bool refill();
  void parse(std::string_view line);
  double parse_field(std::string_view field) const;

  std::string path_;
  char separator_;
  ReadRules rules_;
  bool is_cut_ = false;
  int file_ = -1;
  std::vector<char> buffer_;
  size_t begin_ = 0, end_ = 0;  // of what is read and not yet used
  bool at_end_ = false;
  size_t file_bytes_ = 0;
  size_t line_bytes_ = 0;  // of the present record
  int64_t line_ = 0;
  int64_t records_ = 0;
  std::vector<double> values_;
  std::string header_;
  std::string comments_;
  std::string last_comment_;  // before the first record
};

}  // namespace sextant
