#include "sextant/datasets/codec/text_rows.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

namespace sextant {
namespace {

constexpr size_t block_bytes = size_t{1} << 18;
constexpr size_t longest_line = size_t{1} << 16;

}  // namespace

TextLines::TextLines(std::string_view bytes, std::string name) : name_(std::move(name)), rest_(bytes) {
  if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);
  if (rest_.starts_with("\xff\xfe") || rest_.starts_with("\xfe\xff"))
    fail("{}: is UTF-16 text; save it as UTF-8 or ASCII", name_);
}

TextLines::TextLines(const std::string& path, const FileKind& kind, bool whole_lines) : TextLines("", path) {
  file_.emplace(path, kind);
  file_bytes_ = file_->size();
  whole_lines_ = whole_lines;
  refill();
  const TextLines start(rest_, name_);
  rest_ = start.rest_;  // without the byte order mark
}

bool TextLines::refill() {
  if (!file_) return false;
  if (!rest_.empty()) std::memmove(buffer_.data(), rest_.data(), rest_.size());
  buffer_.resize(rest_.size() + block_bytes);
  const size_t n = file_->read(buffer_.data() + rest_.size(), block_bytes, at_);
  at_ += n;
  rest_ = {buffer_.data(), rest_.size() + n};
  if (n < block_bytes) file_.reset();
  return n > 0;
}

bool TextLines::next(std::string_view& line) {
  for (;;) {
    const size_t end = rest_.find('\n');
    if (end == std::string_view::npos) {
      if (file_ && rest_.size() > longest_line) {
        ++number_;
        fail_here("a line of more than {} bytes: expected a text file of numbers", longest_line);
      }
      if (refill()) continue;
      is_cut_ = whole_lines_ && !rest_.empty();
      if (is_cut_ || rest_.empty()) return false;
    }
    ++number_;
    line = trimmed(rest_.substr(0, end));
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (!line.empty()) return true;
  }
}

bool TextRows::next() {
  fields_.clear();
  std::string_view line;
  do {
    if (!lines_.next(line)) return false;
  } while (comment_ != '\0' && line.front() == comment_);
  for_each_field(line, separator_, [&](std::string_view field) { fields_.push_back(field); });
  return true;
}

std::string_view TextRows::field(size_t i) const {
  if (i >= fields_.size()) fail_here("expected at least {} values, got {}", i + 1, fields_.size());
  return fields_[i];
}

void TextRows::expect(size_t n, std::string_view what) const {
  if (fields_.size() != n) fail_here("expected {}, got {}", what, fields_.size());
}

double TextRows::number(size_t i, std::string_view what) const {
  const std::optional<double> value = number_in(field(i));
  if (!value) fail_here("expected a number for {}, got '{}'", what, field(i));
  return *value;
}

double TextRows::finite(size_t i, std::string_view what) const {
  const double value = number(i, what);
  if (!std::isfinite(value)) fail_here("expected a finite number for {}, got '{}'", what, field(i));
  return value;
}

double TextRows::metres(size_t i, std::string_view what) const {
  constexpr double largest_m = 1e7;
  const double value = finite(i, what);
  if (std::abs(value) > largest_m)
    fail_here("expected metres between -1e7 and 1e7 for {}, got '{}'", what, field(i));
  return value;
}

double TextRows::radians(size_t i, std::string_view what) const {
  const double value = finite(i, what);
  if (std::abs(value) > 4 * std::numbers::pi)
    fail_here("expected radians between -4 pi and 4 pi for {}, got '{}': convert degrees to radians", what,
              field(i));
  return value;
}

ImageBox TextRows::box(size_t first) const {
  const auto edge = [&](size_t i) { return finite(first + i, "the box"); };
  return ordered({edge(0), edge(1), edge(2), edge(3)});
}

ImageBox TextRows::ordered(const ImageBox& box) const {
  if (box.right < box.left || box.bottom < box.top) {
    fail_here(
        "expected a box with left <= right and top <= bottom, got left {}, top {}, right {}, bottom {}: is "
        "it written as x, y, width, height?",
        box.left, box.top, box.right, box.bottom);
  }
  return box;
}

int TextRows::integer(size_t i, std::string_view what) const {
  const std::optional<double> value = number_in(field(i));
  if (!value || *value != std::trunc(*value) || std::abs(*value) > std::numeric_limits<int>::max()) {
    fail_here("expected a whole number for {}, got '{}'", what, field(i));
  }
  return static_cast<int>(*value);
}

int TextRows::up_to(int largest, size_t i, std::string_view what) const {
  const int value = integer(i, fmt::format("the {}", what));
  if (value < 0) fail_here("expected a {} >= 0, got {}", what, value);
  if (value > largest) fail_here("expected a {} of at most {}, got {}", what, largest, value);
  return value;
}

int TextRows::frame(size_t i) const { return up_to(9'999'999, i, "frame number"); }
int TextRows::track(size_t i) const { return up_to(65534, i, "track id"); }

TextTable::TextTable(std::string_view bytes, std::string name, std::vector<std::string> names)
    : rows_(bytes, std::move(name)), names_(std::move(names)) {
  if (!rows_.next()) {
    fail_here("expected a first row with the names of the columns ({}), got an empty file",
              fmt::join(names_, " "));
  }
  n_columns_ = rows_.fields().size();
  std::vector<std::string> missing;
  for (const std::string& column : names_) {
    const auto found = std::ranges::find(rows_.fields(), std::string_view(column));
    columns_.push_back(static_cast<size_t>(found - rows_.fields().begin()));
    if (found == rows_.fields().end()) missing.push_back(column);
  }
  if (!missing.empty()) {
    fail_here("the first row names no column {}: expected {}", fmt::join(missing, ", "),
              fmt::join(names_, " "));
  }
}

bool TextTable::next() {
  at_ = 0;
  if (!rows_.next()) return false;
  if (rows_.fields().size() != n_columns_) {
    fail_here("expected {} values, one for each column that the first row names, got {}", n_columns_,
              rows_.fields().size());
  }
  return true;
}

size_t TextTable::step() {
  SEXTANT_CHECK(at_ < columns_.size());
  return at_++;
}

double TextTable::finite() {
  const size_t i = step();
  return rows_.finite(columns_[i], names_[i]);
}

double TextTable::metres() {
  const size_t i = step();
  return rows_.metres(columns_[i], names_[i]);
}

double TextTable::radians() {
  const size_t i = step();
  return rows_.radians(columns_[i], names_[i]);
}

Eigen::Vector3d TextTable::vector_m() { return Eigen::Vector3d{metres(), metres(), metres()}; }

int TextTable::integer() {
  const size_t i = step();
  return rows_.integer(columns_[i], names_[i]);
}

int TextTable::not_negative() {
  const int value = integer();
  if (value < 0) fail_here("expected 0 or more for {}, got {}", names_[at_ - 1], value);
  return value;
}

int TextTable::frame() { return rows_.frame(columns_[step()]); }
int TextTable::track() { return rows_.track(columns_[step()]); }

uint8_t TextTable::component() {
  const int value = integer();
  if (value < 0 || value > 255) fail_here("expected a colour of 0 to 255, got {}", value);
  return static_cast<uint8_t>(value);
}

bool TextTable::flag() {
  const size_t i = step();
  const std::string_view text = rows_.field(columns_[i]);
  if (text == "1" || text == "True") return true;
  if (text == "0" || text == "False") return false;
  fail_here("expected 0, 1, True or False for {}, got '{}'", names_[i], text);
}

std::string TextTable::word() { return std::string(rows_.field(columns_[step()])); }

}  // namespace sextant
