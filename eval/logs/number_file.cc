#include "sextant/eval/logs/number_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

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

struct Name {
  std::vector<std::string> words;  ///< lower case
  std::string text;                ///< as in the header, in lower case and without unit
  std::string unit;                ///< in brackets; may be empty
};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Returns the number of characters up to the comma that ends the first field of a CSV line. A field that
/// begins with a double quote ends behind the closing one, if there is one; "" inside it is a quote.
size_t field_bytes(std::string_view line) {
  size_t from = line.find_first_not_of(" \t");
  if (from != std::string_view::npos && line[from] == '"') {
    size_t end = line.find('"', from + 1);
    while (end != std::string_view::npos && line.substr(end + 1).starts_with('"'))
      end = line.find('"', end + 2);
    if (end != std::string_view::npos) return std::min(line.find(',', end), line.size());
  }
  return std::min(line.find(','), line.size());
}

/// Calls use(field) as for_each_field() does, but commas inside double quotes are no separators.
template <typename Use>
void for_each_cell(std::string_view line, char separator, const Use& use) {
  if (separator != ',' || line.find('"') == std::string_view::npos)
    return for_each_field(line, separator, use);
  for (size_t end; (end = field_bytes(line)) < line.size(); line.remove_prefix(end + 1))
    use(trimmed(line.substr(0, end)));
  use(trimmed(line));
}

/// Splits names at commas outside of double quotes, or at blanks if there is no comma; a bracket belongs to
/// the name before it.
std::vector<Name> names_of(std::string_view header) {
  while (!header.empty() && (header.front() == '#' || header.front() == '%' || is_blank(header.front())))
    header.remove_prefix(1);
  while (!header.empty() && (is_blank(header.back()) || header.back() == ',')) header.remove_suffix(1);
  const bool commas = header.find(',') != std::string_view::npos;
  const bool quotes_close = std::ranges::count(header, '"') % 2 == 0;
  std::vector<Name> names;
  std::string word;
  bool open = false, ended = true;  // inside brackets; the next letter begins a name
  bool quoted = false;
  char before = '\0';
  const auto end_word = [&] {
    if (!word.empty()) names.back().words.push_back(std::move(word));
    word.clear();
  };
  for (const char c : lower_case(header)) {
    if (c == '"') quoted = quotes_close && !quoted && (ended || before == '"');
    before = c;
    if (open) {
      if (c == ']' || c == ')') {
        open = false;
      } else if (!is_blank(c)) {
        names.back().unit.push_back(c);
      }
    } else if ((c == ',' && !quoted) || (!commas && is_blank(c))) {
      if (!names.empty()) end_word();
      if (c == ',' && ended) names.emplace_back();
      ended = true;
    } else if (c == '[' || c == '(') {
      if (names.empty()) names.emplace_back();
      end_word();
      open = true;
    } else if (is_blank(c) || c == '_' || c == '.' || c == '-' || c == '/' || c == '"' || c == ',') {
      if (!names.empty()) end_word();
      if (!ended && !is_blank(c) && c != '"') names.back().text.push_back(c);
    } else {
      if (ended) names.emplace_back();
      ended = false;
      word.push_back(c);
      names.back().text.push_back(c);
    }
  }
  if (!names.empty()) end_word();
  return names;
}

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

double seconds_in(std::string_view unit) {
  if (is_one_of(unit, {"s", "sec", "secs", "second", "seconds"})) return 1;
  if (is_one_of(unit, {"ms", "msec", "milliseconds"})) return 1e-3;
  if (is_one_of(unit, {"us", "usec", "microseconds"})) return 1e-6;
  if (is_one_of(unit, {"ns", "nsec", "nanosec", "nanoseconds"})) return 1e-9;
  return 0;
}

/// Returns the unit of a time column, 0 if it is not given; nullopt for other columns.
std::optional<double> time_unit(const Name& name) {
  std::vector<std::string> words = name.words;
  double unit = seconds_in(name.unit);
  if (words.size() > 1 && seconds_in(words.back()) > 0) {
    unit = seconds_in(words.back());
    words.pop_back();
  }
  if (words.empty()) return std::nullopt;
  if (words.size() == 1 && is_one_of(words[0], {"t", "ts"})) return unit;
  if (is_one_of(words.back(), {"time", "stamp", "timestamp", "timestamps"})) return unit;
  return std::nullopt;
}

bool has_word(const std::vector<std::string>& words, std::span<const std::string_view> known) {
  return std::ranges::any_of(words, [&](const std::string& w) { return std::ranges::count(known, w) > 0; });
}

/// Words of quantities that are no pose: truth next to an estimate, velocities, biases, covariances.
constexpr std::string_view other_quantities[] = {
    "gt",  "truth", "v",    "vel", "velocity", "linear", "angular",    "twist", "w",    "a",
    "acc", "b",     "bias", "bw",  "ba",       "cov",    "covariance", "std",   "sigma"};

/// Returns 0 .. 2 for x y z of a position, 3 .. 6 for x y z w of a quaternion, -1 for others.
int component(const Name& name) {
  if (name.words.empty()) return -1;
  std::vector<std::string> words = name.words;
  const size_t axis = std::string_view("xyzw").find(words.back().back());
  if (axis == std::string_view::npos) return -1;
  words.back().pop_back();
  if (words.back().empty()) words.pop_back();
  const auto any = [&](std::initializer_list<std::string_view> known) { return has_word(words, known); };
  if (has_word(words, other_quantities)) return -1;
  if (any({"q", "quat", "quaternion", "orientation", "ori", "rot", "rotation"}))
    return 3 + static_cast<int>(axis);
  if (axis < 3 && (words.empty() || any({"t", "p", "pos", "position", "trans", "translation"})))
    return static_cast<int>(axis);
  return -1;
}

/// Returns the names of three or more columns that seem to be a rotation, "roll, pitch, yaw"; empty if there
/// are fewer.
std::string rotation_of_other_names(const std::vector<Name>& names) {
  std::vector<std::string> found;
  for (const Name& name : names) {
    const auto words = std::span(name.words);
    if (words.empty() || has_word({words.begin(), words.end() - 1}, other_quantities)) continue;
    if (is_one_of(name.words.back(), {"q0", "q1", "q2", "q3", "qi", "qj", "qk", "i", "j", "k", "w", "rx",
                                      "ry", "rz", "rw", "roll", "pitch", "yaw", "heading"}))
      found.push_back(name.words.back());
  }
  return found.size() < 3 ? "" : fmt::format("{}", fmt::join(found, ", "));
}

/// Returns the columns of the twelve names of OpenVINS; nullopt if one is missing.
std::optional<std::array<size_t, 12>> covariance_columns(const std::vector<Name>& names) {
  constexpr std::array<std::string_view, 12> expected = {"pr11", "pr12", "pr13", "pr22", "pr23", "pr33",
                                                         "pt11", "pt12", "pt13", "pt22", "pt23", "pt33"};
  std::array<size_t, 12> out{};
  for (size_t k = 0; k < expected.size(); ++k) {
    const auto at = std::ranges::find_if(
        names, [&](const Name& name) { return name.words.size() == 1 && name.words[0] == expected[k]; });
    if (at == names.end()) return std::nullopt;
    out[k] = static_cast<size_t>(at - names.begin());
  }
  return out;
}

}  // namespace

NumberFile::NumberFile(const std::string& path, char separator, const ReadRules& rules)
    : lines_(path, rules.kind.value_or(data_file), rules.whole_lines), separator_(separator) {}

size_t NumberFile::expected_records() const {
  return std::min(static_cast<size_t>(lines_.file_bytes()) / (line_bytes_ + 1) + 16, size_t{1} << 20);
}

bool NumberFile::next() {
  values_.clear();
  fields_.clear();
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
    const bool is_ended = line.back() == separator_;  // some writers end each line with a separator
    if (is_ended) line.remove_suffix(1);
    for_each_cell(line, separator_, [this](std::string_view field) {
      const std::optional<double> value = allows_text_ ? number_in(field) : parse(field, values_.size());
      values_.push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
      fields_.push_back(field);
    });
    if (records_ == 0) {
      n_values_ = values_.size();
    } else if (allows_text_ && is_ended && values_.size() + 1 == n_values_) {
      values_.push_back(std::numeric_limits<double>::quiet_NaN());  // the last field is empty
      fields_.emplace_back();
    }
    ++records_;
    return true;
  }
  return false;
}

std::optional<int64_t> NumberFile::integer(size_t i) const {
  return whole_number<int64_t>(trimmed(fields_.at(i)));
}

int NumberFile::whole(size_t i, const char* what) const {
  const double value = values_[i];
  if (value != std::trunc(value) || value < 0 || value > 1e9)
    fail_here("expected {} for value {}, got {}", what, i + 1, value);
  return static_cast<int>(value);
}

void NumberFile::require(size_t i) const {
  if (!std::isfinite(values_[i])) parse(fields_[i], i);
}

void NumberFile::require_all() const {
  for (size_t i = 0; i < values_.size(); ++i) require(i);
}

double NumberFile::parse(std::string_view field, size_t i) const {
  const std::optional<double> value = number_in(field);
  const size_t column = i + 1;
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

bool PoseColumns::in_order(bool w_first) const {
  const std::array<size_t, 4> last = {4, 5, 6, 7}, first = {5, 6, 7, 4};
  return has_quaternion && time == 0 && position == std::array<size_t, 3>{1, 2, 3} &&
         quaternion == (w_first ? first : last);
}

std::string column_problem(std::string_view header, size_t n_columns) {
  constexpr std::array<std::string_view, 8> components = {"x", "y", "z", "qx", "qy", "qz", "qw", "time"};
  constexpr size_t fewest_known = 4;  // a line of text may contain a few of the names
  const std::vector<Name> names = names_of(header);
  std::array<std::vector<std::string>, components.size()> found;
  size_t n_known = 0;
  for (const Name& name : names) {
    const int k = time_unit(name) ? 7 : component(name);
    if (k < 0) continue;
    found[static_cast<size_t>(k)].push_back(name.text);
    ++n_known;
  }
  if (n_known < fewest_known) return "";
  if (names.size() != n_columns) {
    return fmt::format("its header has {} names, but the first record has {} values", names.size(),
                       n_columns);
  }
  for (size_t k = 0; k < found.size(); ++k) {
    if (found[k].size() > 1)
      return fmt::format("its header names {} twice ('{}')", components[k], fmt::join(found[k], "', '"));
  }
  std::vector<std::string_view> missing;
  for (size_t k = 0; k < found.size(); ++k) {
    if (found[k].empty()) missing.push_back(components[k]);
  }
  return missing.empty() ? "" : fmt::format("its header names no column of {}", fmt::join(missing, ", "));
}

std::optional<PoseColumns> columns_of(std::string_view header, size_t n_columns, const std::string& place) {
  const std::vector<Name> names = names_of(header);
  if (names.size() != n_columns) return std::nullopt;
  PoseColumns out;
  std::array<int, 8> found{};
  std::string unit;
  for (size_t i = 0; i < names.size(); ++i) {
    if (const auto seconds = time_unit(names[i])) {
      out.time = i;
      out.seconds_per_unit = *seconds;
      ++found[7];
      continue;
    }
    const int k = component(names[i]);
    if (k < 0) continue;
    ++found[static_cast<size_t>(k)];
    if (k < 3) {
      out.position[static_cast<size_t>(k)] = i;
      if (!is_one_of(names[i].unit, {"", "m", "meter", "meters", "metre", "metres"})) unit = names[i].unit;
    } else {
      out.quaternion[static_cast<size_t>(k - 3)] = i;
    }
  }
  const auto once = [](int n) { return n == 1; };
  const auto none = [](int n) { return n == 0; };
  out.has_quaternion = !std::all_of(found.begin() + 3, found.begin() + 7, none);
  if (out.has_quaternion && !std::all_of(found.begin(), found.end(), once)) return std::nullopt;
  if (!std::all_of(found.begin(), found.begin() + 3, once) || !once(found[7])) return std::nullopt;
  if (!out.has_quaternion) out.unread_rotation = rotation_of_other_names(names);
  out.covariance = covariance_columns(names);
  if (!unit.empty()) fail("{}: the header gives positions in [{}]: convert them to metres", place, unit);
  return out;
}

bool header_contradicts(std::string_view header, std::string_view names) {
  std::string plain;
  for (const char c : lower_case(header)) {
    if (!is_blank(c) && c != '"' && c != '#') plain.push_back(c);
  }
  while (plain.ends_with(',')) plain.pop_back();
  return plain != names && std::ranges::count(plain, ',') == std::ranges::count(names, ',');
}

bool header_reorders(std::string_view header, std::string_view names) {
  const auto words_of = [](std::string_view text) {
    std::vector<std::string> words(1);
    for (const char c : lower_case(text)) {
      if (c == ',' || is_blank(c) || c == '#' || c == '"') {
        if (!words.back().empty()) words.emplace_back();
      } else {
        words.back().push_back(c);
      }
    }
    if (words.back().empty()) words.pop_back();
    return words;
  };
  std::vector<std::string> given = words_of(header), expected = words_of(names);
  if (given == expected) return false;
  std::ranges::sort(given);
  std::ranges::sort(expected);
  return given == expected;
}

}  // namespace sextant
