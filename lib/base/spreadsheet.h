#pragma once

// Texts of untrusted input on their way into tables that people open in a terminal or a spreadsheet.

#include <string>
#include <string_view>

namespace sextant {

/// Each control character of bidirectional text (U+202A to U+202E, U+2066 to U+2069), which reorders what is shown around
/// it, as its code point: "U+202E".
std::string with_directions_shown(std::string_view text);

/// csv_field() of with_directions_shown(). A text that a spreadsheet would take for a formula, because it begins with
/// = + - @, a tab or a carriage return and is no number, gets an apostrophe before it and is quoted (OWASP, "CSV
/// injection").
std::string spreadsheet_field(std::string_view text);

}  // namespace sextant
