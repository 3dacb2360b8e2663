#pragma once

// Streams a text file of numbers with one record per line: any size, a few MB of memory, about 25 ns per
// number.
//
//   NumberFile file(path, ' ');
//   while (file.next()) series.add(file.values()[1], ...);
//
// Lines and fields are those of datasets/codec/text_rows.h. Lines that begin with '#' are comments. If the
// first record does not begin with a number, it is a header, which header() returns. Every other field must
// be a finite number in C notation; all messages start with "PATH:LINE: " and say what to do.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/codec/text_rows.h"
#include "sextant/eval/logs/covariance_convention.h"

namespace sextant {

/// Rules for reading a file that may be too large or unfinished.
struct ReadRules {
  std::optional<FileKind> kind = std::nullopt;  ///< nullopt: the default of the reader
  /// leaves out a last line without its end of line, which may contain a truncated number
  bool whole_lines = false;
  /// Convention of pose covariances; nullopt: determined by the number of values.
  std::optional<CovarianceConvention> covariance = std::nullopt;
};

class NumberFile {
 public:
  /// Separator determined by the first record: a comma if it contains one, otherwise blanks.
  static constexpr char either = '\0';

  /// Opens a file; `separator` as in for_each_field(). Throws Error if the file cannot be read.
  NumberFile(const std::string& path, char separator, const ReadRules& rules = {});

  /// Advances to the next record; returns false at the end. Throws Error on a value that is not a finite
  /// number.
  bool next();

  std::span<const double> values() const { return values_; }
  int64_t line() const { return lines_.number(); }  ///< from 1
  bool is_cut() const { return lines_.is_cut(); }   ///< at the end: true if the last line was left out
  /// Returns the approximate number of records, judged by the first one; at most 2^20, since later ones may
  /// be longer.
  size_t expected_records() const;
  const std::string& path() const { return lines_.name(); }
  const std::string& header() const { return header_; }      ///< trimmed; may be empty
  const std::string& comments() const { return comments_; }  ///< comments in the first lines, at most 4 kB
  /// Returns the header, otherwise the last comment before the first record: the line that may contain column
  /// names.
  const std::string& column_names() const { return header_.empty() ? last_comment_ : header_; }
  char separator() const { return separator_; }

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    lines_.fail_here(format, std::forward<Args>(args)...);
  }

 private:
  double parse(std::string_view field) const;

  TextLines lines_;
  char separator_;
  size_t line_bytes_ = 0;  // length of the current record
  int64_t records_ = 0;
  std::vector<double> values_;
  std::string header_;
  std::string comments_;
  std::string last_comment_;  // before the first record
};

}  // namespace sextant
