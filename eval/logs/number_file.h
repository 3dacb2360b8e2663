#pragma once

// Streams a text file of numbers, one record a line: any size, a few MB of memory, about 25 ns a number.
//
//   NumberFile file(path, ' ');
//   while (file.next()) series.add(file.values()[1], ...);
//
// Lines and fields as in datasets/codec/text_rows.h. Lines that begin with '#' are comments. A file whose
// first record does not begin with a number has a header there, which header() gives. Every other field must
// be a finite number in C notation; all messages start "PATH:LINE: " and say what to do.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/codec/text_rows.h"
#include "sextant/eval/logs/covariance_convention.h"

namespace sextant {

/// What a reader takes of a file that may be too large or unfinished.
struct ReadRules {
  std::optional<FileKind> kind = std::nullopt;  ///< empty: the reader's own
  bool whole_lines = false;  ///< a last line without its end, which may hold half a number, is left out
  std::optional<CovarianceConvention> covariance =
      std::nullopt;  ///< of poses; empty: by how many numbers it has
};

class NumberFile {
 public:
  /// A separator that the first record decides: a comma where it has one, else blanks.
  static constexpr char either = '\0';

  /// `separator` as for_each_field() has it. Throws Error when the file cannot be read.
  NumberFile(const std::string& path, char separator, const ReadRules& rules = {});

  /// Steps to the next record; false at the end. Throws Error on what is no finite number.
  bool next();

  std::span<const double> values() const { return values_; }
  int64_t line() const { return lines_.number(); }  ///< 1 for the first of the file
  bool is_cut() const { return lines_.is_cut(); }   ///< at the end: the last line was left out
  /// About how many records the file has, judged by the first; at most 2^20, as later ones may be longer.
  size_t expected_records() const;
  const std::string& path() const { return lines_.name(); }
  const std::string& header() const { return header_; }      ///< without blanks at the ends; may be empty
  const std::string& comments() const { return comments_; }  ///< of the first lines, at most 4 kB
  /// The header, else the last comment before the first record: where the columns have names, they are here.
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
  size_t line_bytes_ = 0;  // of the present record
  int64_t records_ = 0;
  std::vector<double> values_;
  std::string header_;
  std::string comments_;
  std::string last_comment_;  // before the first record
};

}  // namespace sextant
