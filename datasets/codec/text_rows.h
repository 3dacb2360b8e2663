#pragma once

// Text files of one record per line: numbers and words separated by blanks, tabs or one given separator.
// Accepts CRLF, a byte order mark, blanks at either end, and empty lines. All messages start "NAME:LINE: ".
//
//   for (TextRows rows(bytes, path); rows.next();) {
//     rows.expect(2, "time and value");
//     series.emplace(rows.finite(0, "time"), rows.finite(1, "value"));
//   }

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {

class TextRows {
 public:
  /// `separator` ' ': runs of blanks and tabs; any other character: exactly one between fields, which are
  /// trimmed and may be empty. Lines that start with `comment` are skipped; '\0' = there are none.
  /// `bytes` must outlive the reader.
  TextRows(std::string_view bytes, std::string name, char separator = ' ', char comment = '\0');

  /// Steps to the next line that is not empty; false at the end.
  bool next();

  int line() const { return line_; }  ///< 1 for the first of the file
  std::span<const std::string_view> fields() const { return fields_; }
  std::string_view field(size_t i) const;

  /// Throws "NAME:LINE: expected WHAT, got N" unless there are `n` fields.
  void expect(size_t n, std::string_view what) const;

  double number(size_t i, std::string_view what) const;  ///< may be NaN or infinite
  double finite(size_t i, std::string_view what) const;
  double metres(size_t i,
                std::string_view what) const;  ///< finite, at most 1e7 from 0: anything else is no pose
  int integer(size_t i, std::string_view what) const;  ///< also written as "3.0" or "3e0"
  int frame(size_t i) const;                           ///< a frame number: 0 to 9,999,999
  int track(size_t i) const;  ///< a track id: 0 to 65534, so that masks can hold it + 1

  /// Throws Error "NAME:LINE: " + message.
  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    fail("{}:{}: {}", name_, line_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  void split_line(std::string_view text);

  std::string_view rest_;
  std::string name_;
  char separator_;
  char comment_;
  int line_ = 0;
  std::vector<std::string_view> fields_;
};

}  // namespace sextant
