#pragma once

// The words of tables and reports, explained: the one home of what docs/metrics.md and `sextant explain` say of them.
//
//   words of the field and of this program   the table in words.cc
//   what a status is                         the table of statuses there
//   numbers of a record                      metrics/definitions.h
//   presets                                  metrics/definitions.h

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

struct Word {
  std::string word;                   ///< as tables have it: "coverage", "E_t", "errors.Et_m"
  std::string kind;                   ///< "word", "status", "number", "preset"
  std::string meaning;                ///< one or a few sentences
  std::vector<std::string> others{};  ///< other names of it
};

/// Words, then statuses, numbers and presets.
std::span<const Word> all_words();

/// Those that are called so; letters' case, '_', '-' and blanks do not matter. Throws Error that names the nearest.
std::vector<const Word*> explain(std::string_view word);

}  // namespace sextant
