#include "sextant/eval/logs/number_file.h"

#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr size_t most_comment_bytes = 4096;

bool begins_as_number(std::string_view text) {
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  const std::string_view word = text.substr(0, 3);
  return !text.empty() && ((text[0] >= '0' && text[0] <= '9') || text[0] == '.' || word == "nan" ||
                           word == "NaN" || word == "inf" || word == "Inf" || word == "NAN" || word == "INF");
}

std::string shown(std::string_view field) {
  return field.size() <= 40 ? std::string(field) : std::string(field.substr(0, 37)) + "...";
}

}  // namespace

NumberFile::NumberFile(const std::string& path, char separator, const ReadRules& rules)
    : lines_(path, rules.kind.value_or(data_file), rules.whole_lines), separator_(separator) {}

size_t NumberFile::expected_records() const {
  return std::min(static_cast<size_t>(lines_.file_bytes()) / (line_bytes_ + 1) + 16, size_t{1} << 20);
}

bool NumberFile::next() {
  values_.clear();
  for (std::string_view line; lines_.next(line);) {
    if (line.front() == '#') {
      if (comments_.size() + line.size() < most_comment_bytes) comments_.append(line).push_back('\n');
      if (records_ == 0) last_comment_ = line.substr(0, most_comment_bytes);
      continue;
    }
    if (records_ == 0 && header_.empty() && !begins_as_number(line)) {
      if (line.find('\0') != std::string_view::npos) fail_here("contains a zero byte: expected a text file");
      header_ = line.substr(0, most_comment_bytes);
      continue;
    }
    line_bytes_ = line.size();
    if (separator_ == either) separator_ = line.find(',') != std::string_view::npos ? ',' : ' ';
    if (line.back() == separator_) line.remove_suffix(1);  // some writers end each line with a separator
    for_each_field(line, separator_, [this](std::string_view field) { values_.push_back(parse(field)); });
    ++records_;
    return true;
  }
  return false;
}

double NumberFile::parse(std::string_view field) const {
  const std::optional<double> value = number_in(field);
  const size_t column = values_.size() + 1;
  if (value && std::isfinite(*value)) return *value;
  if (value) {
    fail_here("value {} is '{}', which is not a finite number: remove poses that were not estimated", column,
              shown(field));
  }
  if (field.empty()) fail_here("value {} is empty: a number was expected", column);
  if (field.find_first_of(", ") != std::string_view::npos) {
    fail_here(
        "expected a number for value {}, got '{}': write numbers with a decimal point and without thousands "
        "separators, and one separator between all of them: blanks or commas",
        column, shown(field));
  }
  fail_here("expected a number for value {}, got '{}'", column, shown(field));
}

}  // namespace sextant
