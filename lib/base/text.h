#pragma once

// Small text helpers: for messages, and for texts of strangers on their way to a page or a terminal.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

/// Levenshtein distance.
int edit_distance(std::string_view a, std::string_view b);

/// The name nearest to `word`, or an empty view when none is near enough to be a likely misspelling.
std::string_view nearest_name(std::string_view word, std::span<const std::string> names);

/// "did you mean 'x'? " or "" plus "known: a, b, c".
std::string suggest(std::string_view word, std::span<const std::string> names);

/// The pieces of `text` between `separator`s (n separators give n + 1 pieces).
std::vector<std::string> split(std::string_view text, char separator);

/// Without blanks, tabs and carriage returns at its ends.
std::string_view trimmed(std::string_view text);

/// Not empty, and all of 0 to 9.
bool is_digits(std::string_view text);

/// The number that the whole of `text` is in C notation, also with a '+' before it; what is beyond a double
/// is infinite, what is too small for one is 0. Empty when it is none.
std::optional<double> number_in(std::string_view text);

bool is_utf8(std::string_view text);

/// What a page can hold: UTF-8 of characters that XML 1.0 knows; every other byte or character as U+FFFD.
std::string page_text(std::string_view text);

/// page_text() with every control character as a blank: nothing in it breaks a line or talks to a terminal.
std::string one_line(std::string_view text);

/// A text as a field of a CSV file (RFC 4180): quoted where it has to be.
inline std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted(1, '"');
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  quoted.push_back('"');
  return quoted;
}

// Texts of untrusted input on their way into tables that people open in a terminal or a spreadsheet.

/// Each control character of bidirectional text (U+202A to U+202E, U+2066 to U+2069), which reorders what is
/// shown around it, as its code point: "U+202E".
std::string with_directions_shown(std::string_view text);

/// csv_field() of with_directions_shown(). A text that a spreadsheet would take for a formula, because it
/// begins with = + - @, a tab or a carriage return and is no number, gets an apostrophe before it and is
/// quoted (OWASP, "CSV injection").
std::string spreadsheet_field(std::string_view text);

}  // namespace sextant
