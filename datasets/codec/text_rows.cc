#include "sextant/datasets/codec/text_rows.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace sextant {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view trim(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::optional<double> to_double(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range && end == text.data() + text.size()) {
    // 1e-400 is 0 for every purpose here; 1e400 is no number of ours.
    const size_t exponent = text.find_first_of("eE");
    if (exponent != std::string_view::npos && text.substr(exponent + 1).starts_with('-')) return 0.0;
    return std::nullopt;
  }
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

TextRows::TextRows(std::string_view bytes, std::string name, char separator, char comment)
    : rest_(bytes), name_(std::move(name)), separator_(separator), comment_(comment) {
  if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);
}

bool TextRows::next() {
  while (!rest_.empty()) {
    ++line_;
    const size_t end = rest_.find('\n');
    const std::string_view text = trim(rest_.substr(0, end));
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (text.empty() || (comment_ != '\0' && text.front() == comment_)) continue;
    split_line(text);
    return true;
  }
  fields_.clear();
  return false;
}

void TextRows::split_line(std::string_view text) {
  fields_.clear();
  if (separator_ != ' ') {
    for (size_t end; (end = text.find(separator_)) != std::string_view::npos; text.remove_prefix(end + 1)) {
      fields_.push_back(trim(text.substr(0, end)));
    }
    fields_.push_back(trim(text));
    return;
  }
  while (!text.empty()) {
    const size_t end = std::min(text.find_first_of(kBlanks), text.size());
    fields_.push_back(text.substr(0, end));
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks, end), text.size()));
  }
}

std::string_view TextRows::field(size_t i) const {
  if (i >= fields_.size()) fail_here("expected at least {} values, got {}", i + 1, fields_.size());
  return fields_[i];
}

void TextRows::expect(size_t n, std::string_view what) const {
  if (fields_.size() != n) fail_here("expected {}, got {}", what, fields_.size());
}

double TextRows::number(size_t i, std::string_view what) const {
  const std::optional<double> value = to_double(field(i));
  if (!value) fail_here("expected a number for {}, got '{}'", what, field(i));
  return *value;
}

double TextRows::finite(size_t i, std::string_view what) const {
  const double value = number(i, what);
  if (!std::isfinite(value)) fail_here("expected a finite number for {}, got '{}'", what, field(i));
  return value;
}

double TextRows::metres(size_t i, std::string_view what) const {
  constexpr double kLargest_m = 1e7;
  const double value = finite(i, what);
  if (std::abs(value) > kLargest_m)
    fail_here("expected metres between -1e7 and 1e7 for {}, got '{}'", what, field(i));
  return value;
}

int TextRows::frame(size_t i) const {
  constexpr int kLargest = 9'999'999;
  const int value = integer(i, "the frame number");
  if (value < 0) fail_here("expected a frame number >= 0, got {}", value);
  if (value > kLargest) fail_here("expected a frame number of at most {}, got {}", kLargest, value);
  return value;
}

int TextRows::track(size_t i) const {
  constexpr int kLargest = 65534;
  const int value = integer(i, "the track id");
  if (value < 0) fail_here("expected a track id >= 0, got {}", value);
  if (value > kLargest) fail_here("expected a track id of at most {}, got {}", kLargest, value);
  return value;
}

int TextRows::integer(size_t i, std::string_view what) const {
  const std::optional<double> value = to_double(field(i));
  if (!value || *value != std::trunc(*value) || std::abs(*value) > std::numeric_limits<int>::max()) {
    fail_here("expected a whole number for {}, got '{}'", what, field(i));
  }
  return static_cast<int>(*value);
}

}  // namespace sextant
