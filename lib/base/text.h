#pragma once

// Text helpers for messages, and for untrusted text that is shown on a page or a terminal.

#include <algorithm>
#include <charconv>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace sextant {

/// Returns the Levenshtein distance.
int edit_distance(std::string_view a, std::string_view b);

/// Returns the name with the smallest edit distance to `word`; empty if none is near enough to be a likely
/// misspelling, i.e. within 2 or a third of the length of `word`, whichever is larger. Otherwise the first
/// name that continues `word` by an underscore: "epe_px" for "epe".
std::string_view nearest_name(std::string_view word, std::span<const std::string> names);

/// Returns "did you mean 'x'? known: a, b, c"; without the question if no name is near.
std::string suggest(std::string_view word, std::span<const std::string> names);

/// Returns the pieces of `text` between `separator`s; n separators give n + 1 pieces.
std::vector<std::string> split(std::string_view text, char separator);

/// Replaces every occurrence of `what`, which must not be empty, by `by`.
std::string replaced(std::string text, std::string_view what, std::string_view by);

/// Appends an item, for example a text, unless the list contains it: the list stays in order of first
/// appearance.
template <typename Item>
void add_distinct(const std::type_identity_t<Item>& item, std::vector<Item>& list) {
  if (std::ranges::find(list, item) == list.end()) list.push_back(item);
}

/// Returns `text` without leading and trailing blanks, tabs, vertical tabs, form feeds and carriage returns.
std::string_view trimmed(std::string_view text);

/// Returns `text` with the letters A to Z in lower case.
std::string lower_case(std::string_view text);

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
/// Returns true if `text` is not empty and consists of the digits 0 to 9.
bool is_digits(std::string_view text);

/// Returns the number that the whole of `text` spells in decimal notation ("12", "-1.5e3", "inf", "nan"),
/// also with a leading '+'; infinity of the same sign on overflow, 0 on underflow, nullopt if it is not a
/// number.
std::optional<double> number_in(std::string_view text);

/// Returns the whole number that the whole of `text` spells in digits, with a leading '-' if T is signed;
/// nullopt if it is none or does not fit into T.
template <typename T>
std::optional<T> whole_number(std::string_view text) {
  static_assert(std::is_integral_v<T>);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// Returns the runs of successive numbers in a list, in its order: "3-5", "9".
template <typename T>
std::vector<std::string> ranges_of(const std::vector<T>& numbers) {
  std::vector<std::string> ranges;
  for (size_t i = 0, j = 0; i < numbers.size(); i = j + 1) {
    for (j = i; j + 1 < numbers.size() && numbers[j + 1] == numbers[j] + 1;) ++j;
    ranges.push_back(std::to_string(numbers[i]) + (i == j ? "" : "-" + std::to_string(numbers[j])));
  }
  return ranges;
}

bool is_utf8(std::string_view text);

/// Replaces what an XML or HTML page cannot contain: bytes that are not UTF-8 and characters that XML 1.0
/// excludes become U+FFFD. Also applies with_directions_shown().
std::string page_text(std::string_view text);

/// Returns page_text() with every control character replaced by a blank, so that the text cannot break a line
/// or send control sequences to a terminal.
std::string one_line(std::string_view text);

/// Formats a text as a field of a CSV file (RFC 4180), quoted if necessary.
inline std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted(1, '"');
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  quoted.push_back('"');
  return quoted;
}

// Untrusted text in tables that are opened in a terminal or a spreadsheet.

/// Spells out each control character of bidirectional text (U+202A to U+202E, U+2066 to U+2069), which would
/// reorder the text around it, as its code point: "U+202E".
std::string with_directions_shown(std::string_view text);

/// Returns csv_field() of with_directions_shown(). A text that a spreadsheet would interpret as a formula,
/// because it begins with = + - @, a tab or a carriage return and is not a number, is prefixed with an
/// apostrophe and quoted (OWASP, "CSV injection").
std::string spreadsheet_field(std::string_view text);

}  // namespace sextant
