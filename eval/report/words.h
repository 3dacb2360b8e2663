#pragma once

// Definitions of the terms in tables and reports, printed by `sextant explain`. docs/glossary.md (terms) and
// docs/metrics.md (statuses) repeat them; a test compares both.
//
//   terms of the field and of this program   words.json
//   statuses                                 words.json
//   numbers of a record                      metrics/definitions.h
//   presets                                  metrics/definitions.h

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

/// One entry.
struct Word {
  std::string word;                   ///< name in tables: "coverage", "E_t", "errors.Et_m"
  std::string kind;                   ///< "word", "status", "number", "preset"
  std::string meaning;                ///< one or a few sentences
  std::vector<std::string> others{};  ///< other names
};

/// Returns terms, then statuses, numbers and presets.
std::span<const Word> all_words();

/// Returns the entries that have `word` as one of their names, ignoring case, '_', '-' and blanks. Throws
/// Error with the three most similar terms if there are none.
std::vector<const Word*> explain(std::string_view word);

}  // namespace sextant
