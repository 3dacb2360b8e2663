#pragma once

// Text files of one record a line: numbers and words separated by blanks, tabs or one given separator.
// Accepts CRLF, a byte order mark, blanks at either end, and empty lines. All messages start "NAME:LINE: ".
//
//   for (TextRows rows(bytes, path); rows.next();) {
//     rows.expect(2, "time and value");
//     series.emplace(rows.finite(0, "time"), rows.finite(1, "value"));
//   }
//
// Where the first row names the columns, they are found by name: their order and further ones do not matter.
//
//   for (TextTable rows(bytes, path, {"frame", "speed"}); rows.next();) {
//     series.emplace(rows.frame(), rows.finite());  // in the order of the names above
//   }
//
// Files of any size that hold numbers alone: eval/logs/number_file.h, over the same lines and fields.

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

/// Lines of a text, trimmed, without the empty ones.
class TextLines {
 public:
  /// `bytes` must outlive the reader.
  TextLines(std::string_view bytes, std::string name);
  /// Reads the file block by block. `whole_lines`: a last line without its end, which may hold half a number,
  /// is left out. Throws Error when it cannot be read, and on UTF-16.
  TextLines(const std::string& path, const FileKind& kind, bool whole_lines);

  /// False at the end. `line` is valid until the next call.
  bool next(std::string_view& line);
  const std::string& name() const { return name_; }
  int64_t number() const { return number_; }           ///< of the line; 1 for the first of the file
  bool is_cut() const { return is_cut_; }              ///< at the end: the last line was left out
  uint64_t file_bytes() const { return file_bytes_; }  ///< 0: in memory

  /// Throws Error "NAME:LINE: " + message.
  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    fail("{}:{}: {}", name_, number_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  bool refill();

  std::string name_;
  std::string_view rest_;           // read and not yet used
  std::optional<FileReader> file_;  // where more comes from
  bool whole_lines_ = false;
  uint64_t file_bytes_ = 0;
  uint64_t at_ = 0;  // of the file, read so far
  std::vector<char> buffer_;
  int64_t number_ = 0;
  bool is_cut_ = false;
};

/// Calls use(field) for each field of a trimmed line. `separator` ' ': runs of blanks and tabs; any other
/// character: exactly one between fields, which are trimmed and may be empty.
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

/// Appends a line of values, in the shortest digits that read back the same.
template <typename... Values>
void put_line(std::string& out, Values&&... values) {
  (fmt::format_to(std::back_inserter(out), "{} ", std::forward<Values>(values)), ...);
  out.back() = '\n';
}

class TextRows {
 public:
  /// Lines that start with `comment` are passed over; '\0': there are none. `bytes` must outlive the reader.
  TextRows(std::string_view bytes, std::string name, char separator = ' ', char comment = '\0')
      : lines_(bytes, std::move(name)), separator_(separator), comment_(comment) {}

  /// Steps to the next row; false at the end.
  bool next();

  int64_t line() const { return lines_.number(); }
  std::span<const std::string_view> fields() const { return fields_; }
  std::string_view field(size_t i) const;

  /// Throws "NAME:LINE: expected WHAT, got N" unless there are `n` fields.
  void expect(size_t n, std::string_view what) const;

  double number(size_t i, std::string_view what) const;  ///< may be NaN or infinite
  double finite(size_t i, std::string_view what) const;
  double metres(size_t i,
                std::string_view what) const;  ///< finite, at most 1e7 from 0: anything else is no pose
  ImageBox box(size_t first) const;            ///< left, top, right, bottom
  int integer(size_t i, std::string_view what) const;  ///< also written as "3.0" or "3e0"
  int frame(size_t i) const;                           ///< a frame number: 0 to 9,999,999
  int track(size_t i) const;  ///< a track id: 0 to 65534, so that masks can hold it + 1

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
  /// Reads the header. Throws Error when the file is empty, or lacks columns (it names every missing one).
  TextTable(std::string_view bytes, std::string name, std::vector<std::string> names);

  /// Steps to the next row; false at the end. Throws Error unless it has as many fields as the header.
  bool next();

  // The fields of the row in the order of `names`, one a call.
  double finite();
  double metres();
  Eigen::Vector3d vector_m();  ///< three values as metres()
  int integer();
  int not_negative();   ///< integer >= 0
  int frame();          ///< as TextRows::frame
  int track();          ///< as TextRows::track
  uint8_t component();  ///< of a colour
  bool flag();          ///< 0, 1, True, False
  std::string word();

  // The header and the row itself, for fields that go by position.
  size_t n_columns() const { return n_columns_; }
  size_t column(size_t i) const { return columns_[i]; }  ///< where the i-th of `names` stands
  const TextRows& rows() const { return rows_; }

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    rows_.fail_here(format, std::forward<Args>(args)...);
  }

 private:
  size_t step();

  TextRows rows_;
  std::vector<std::string> names_;
  std::vector<size_t> columns_;  // of names_
  size_t n_columns_ = 0;
  size_t at_ = 0;
};

}  // namespace sextant
