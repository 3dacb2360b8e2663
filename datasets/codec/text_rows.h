#pragma once

// Text files with one record per line: numbers and words separated by blanks, tabs or one given separator.
// CRLF, a byte order mark, blanks at either end and empty lines are accepted. Messages about a line start
// with "NAME:LINE: ".
//
//   for (TextRows rows(bytes, path); rows.next();) {
//     rows.expect(2, "time and value");
//     series.emplace(rows.finite(0, "time"), rows.finite(1, "value"));
//   }
//
// If the first row names the columns, they are found by name: their order and additional columns do not
// matter.
//
//   for (TextTable rows(bytes, path, {"frame", "speed"}); rows.next();) {
//     series.emplace(rows.frame(), rows.finite());  // in the order of the names above
//   }
//
// Numeric files of any size: eval/logs/number_file.h, which uses the same lines and fields.

#include <Eigen/Core>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// Iterates over the lines of a text, trimmed and without empty ones.
class TextLines {
 public:
  /// Reads from memory; `bytes` must outlive the reader.
  TextLines(std::string_view bytes, std::string name);
  /// Reads a file block by block. `whole_lines`: a last line without its end of line, which may contain a
  /// truncated number, is left out. Throws Error if the file cannot be read, and on UTF-16.
  TextLines(const std::string& path, const FileKind& kind, bool whole_lines);

  /// Reads the next line, which is valid until the next call; returns false at the end.
  bool next(std::string_view& line);
  const std::string& name() const { return name_; }
  int64_t number() const { return number_; }           ///< line number, from 1
  bool is_cut() const { return is_cut_; }              ///< at the end: true if the last line was left out
  uint64_t file_bytes() const { return file_bytes_; }  ///< 0: in memory

  /// Throws Error "NAME:LINE: " + message.
  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    fail("{}:{}: {}", name_, number_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  bool refill();

  std::string name_;
  std::string_view rest_;           // bytes read but not yet used
  std::optional<FileReader> file_;  // source of further bytes
  bool whole_lines_ = false;
  uint64_t file_bytes_ = 0;
  uint64_t at_ = 0;  // position in the file
  std::vector<char> buffer_;
  int64_t number_ = 0;
  bool is_cut_ = false;
};

/// Calls use(field) for each field of a trimmed line. With the `separator` ' ', fields are separated by runs
/// of blanks and tabs; with any other character, by exactly one, and they are trimmed and may be empty.
template <typename Use>
void for_each_field(std::string_view line, char separator, const Use& use) {
  if (separator != ' ') {
    for (size_t end; (end = line.find(separator)) != std::string_view::npos; line.remove_prefix(end + 1)) {
      use(trimmed(line.substr(0, end)));
    }
    return use(trimmed(line));
  }
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; };
  while (!line.empty()) {
    size_t end = 0;
    while (end < line.size() && !is_blank(line[end])) ++end;
    use(line.substr(0, end));
    while (end < line.size() && is_blank(line[end])) ++end;
    line.remove_prefix(end);
  }
}

/// Appends a line of values, with the fewest digits that read back the same.
template <typename... Values>
void put_line(std::string& out, Values&&... values) {
  (fmt::format_to(std::back_inserter(out), "{} ", std::forward<Values>(values)), ...);
  out.back() = '\n';
}

class TextRows {
 public:
  /// Reads rows from `bytes`, which must outlive the reader. Lines that start with `comment` are skipped;
  /// '\0': no comments.
  TextRows(std::string_view bytes, std::string name, char separator = ' ', char comment = '\0')
      : lines_(bytes, std::move(name)), separator_(separator), comment_(comment) {}

  /// Advances to the next row; returns false at the end.
  bool next();

  int64_t line() const { return lines_.number(); }
  std::span<const std::string_view> fields() const { return fields_; }
  std::string_view field(size_t i) const;

  /// Throws Error "NAME:LINE: expected WHAT, got N" unless there are `n` fields.
  void expect(size_t n, std::string_view what) const;

  double number(size_t i, std::string_view what) const;  ///< may be NaN or infinite
  double finite(size_t i, std::string_view what) const;
  double metres(size_t i,
                std::string_view what) const;  ///< finite and at most 1e7 in magnitude, as poses are
  double radians(size_t i, std::string_view what) const;  ///< finite, between -4 pi and 4 pi
  ImageBox box(size_t first) const;                       ///< left, top, right, bottom; as ordered()
  /// Returns the box. Throws Error that names the row if the right edge is left of the left one, or the
  /// bottom one above the top one.
  ImageBox ordered(const ImageBox& box) const;
  int integer(size_t i, std::string_view what) const;  ///< also accepts "3.0" and "3e0"
  int frame(size_t i) const;                           ///< frame number: 0 to 9,999,999
  int track(size_t i) const;  ///< track id: 0 to 65534, so that masks can contain id + 1

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    lines_.fail_here(format, std::forward<Args>(args)...);
  }

 private:
  int up_to(int largest, size_t i, std::string_view what) const;

  TextLines lines_;
  char separator_;
  char comment_;
  std::vector<std::string_view> fields_;
};

class TextTable {
 public:
  /// Reads the header. Throws Error if the file is empty, or if columns of `names` are missing (all of them
  /// are named).
  TextTable(std::string_view bytes, std::string name, std::vector<std::string> names);

  /// Advances to the next row; returns false at the end. Throws Error unless the row has as many fields as
  /// the header.
  bool next();

  // Fields of the row in the order of `names`, one per call.
  double finite();
  double metres();
  double radians();            ///< as TextRows::radians
  Eigen::Vector3d vector_m();  ///< three values as metres()
  int integer();
  int not_negative();   ///< integer >= 0
  int frame();          ///< as TextRows::frame
  int track();          ///< as TextRows::track
  uint8_t component();  ///< component of a colour
  bool flag();          ///< 0, 1, True, False
  std::string word();

  // Access by position to the header and the row, in addition to access by name.
  size_t n_columns() const { return n_columns_; }
  size_t column(size_t i) const { return columns_[i]; }  ///< position of the i-th of `names`
  const TextRows& rows() const { return rows_; }

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    rows_.fail_here(format, std::forward<Args>(args)...);
  }

 private:
  size_t step();

  TextRows rows_;
  std::vector<std::string> names_;
  std::vector<size_t> columns_;  // positions of names_
  size_t n_columns_ = 0;
  size_t at_ = 0;
};

}  // namespace sextant
