#include "sextant/base/text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <numeric>

namespace sextant {
namespace {

struct Character {
  uint32_t code = 0;
  size_t bytes = 0;  ///< 0: not valid UTF-8
};

/// Returns the first character of a text that is not empty. Accepts shortest forms only, no surrogates.
Character first_character(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return {first, 1};
  const size_t n = first >= 0xF8 ? 0 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : first >= 0xC2 ? 2 : 0;
  if (n == 0 || text.size() < n) return {};
  uint32_t code = first & (0xFFU >> (n + 1));
  for (size_t i = 1; i < n; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return {};
    code = (code << 6U) | (byte(i) & 0x3FU);
  }
  constexpr uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  return code < least[n] || code > 0x10FFFF || is_surrogate ? Character{} : Character{code, n};
}

bool is_control(uint32_t code) { return code < 0x20 || (code >= 0x7F && code < 0xA0); }

bool is_in_xml(uint32_t code) {
  return code == '\t' || code == '\n' || code == '\r' || (code >= 0x20 && code != 0xFFFE && code != 0xFFFF);
}

/// Returns true for embeddings, overrides and isolates of bidirectional text (Unicode TR 9), which reorder
/// the text around them.
bool is_direction(uint32_t code) {
  return (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

/// Replaces every character that `leave` rejects by `replacement`.
template <typename Leave>
std::string cleaned(std::string_view text, std::string_view replacement, const Leave& leave) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Character c = first_character(text);
    const size_t n = std::max<size_t>(1, c.bytes);
    out.append(c.bytes > 0 && leave(c.code) ? text.substr(0, n) : replacement);
    text.remove_prefix(n);
  }
  return out;
}

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int substituted = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

std::string_view nearest_name(std::string_view word, std::span<const std::string> names) {
  std::string_view best;
  int best_distance = std::max<int>(2, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& name : names) {
    const int distance = edit_distance(word, name);
    if (distance < best_distance) {
      best_distance = distance;
      best = name;
    }
  }
  if (!best.empty() || word.empty()) return best;
  const std::string without_unit = std::string(word) + "_";
  const auto with_unit =
      std::ranges::find_if(names, [&](const std::string& name) { return name.starts_with(without_unit); });
  return with_unit == names.end() ? best : *with_unit;
}

std::string suggest(std::string_view word, std::span<const std::string> names) {
  const std::string_view nearest = nearest_name(word, names);
  const std::string hint = nearest.empty() ? "" : fmt::format("did you mean '{}'? ", nearest);
  return fmt::format("{}known: {}", hint, fmt::join(names, ", "));
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> pieces;
  size_t begin = 0;
  for (;;) {
    const size_t end = text.find(separator, begin);
    pieces.emplace_back(text.substr(begin, end - begin));
    if (end == std::string_view::npos) return pieces;
    begin = end + 1;
  }
}

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\v\f";
  const size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string lower_case(std::string_view text) {
  std::string lower;
  for (const char c : text) lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

std::optional<double> number_in(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
    if (text.starts_with('-')) return std::nullopt;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || text.empty()) return std::nullopt;
  if (error == std::errc()) return value;
  if (error != std::errc::result_out_of_range) return std::nullopt;
  const size_t exponent = text.find_first_of("eE");
  const bool small = exponent == std::string_view::npos
                         ? text.find('.') < text.find_first_of("123456789")  // 0.000...01
                         : text.substr(exponent + 1).starts_with('-');
  if (small) return 0;
  return text.starts_with('-') ? -std::numeric_limits<double>::infinity()
                               : std::numeric_limits<double>::infinity();
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const Character c = first_character(text);
    if (c.bytes == 0) return false;
    text.remove_prefix(c.bytes);
  }
  return true;
}

std::string with_directions_shown(std::string_view text) {
  if (text.find('\xe2') == std::string_view::npos) return std::string(text);
  std::string out;
  while (!text.empty()) {
    const Character c = first_character(text);
    const size_t n = std::max<size_t>(1, c.bytes);
    if (c.bytes > 0 && is_direction(c.code))
      out += fmt::format("U+{:04X}", c.code);
    else
      out += text.substr(0, n);
    text.remove_prefix(n);
  }
  return out;
}

std::string page_text(std::string_view text) {
  return with_directions_shown(cleaned(text, "\uFFFD", is_in_xml));
}

std::string one_line(std::string_view text) {
  std::string blank = cleaned(text, "\uFFFD", [](uint32_t c) { return is_in_xml(c) || is_control(c); });
  return with_directions_shown(cleaned(blank, " ", [](uint32_t c) { return !is_control(c); }));
}

std::string spreadsheet_field(std::string_view given) {
  const std::string text = with_directions_shown(given);
  const bool is_formula = !text.empty() &&
                          std::string_view("=+-@\t\r").find(text[0]) != std::string_view::npos &&
                          !number_in(text);
  if (!is_formula) return csv_field(text);
  const std::string field = csv_field("'" + text);
  return field.starts_with('"') ? field : '"' + field + '"';
}

}  // namespace sextant
