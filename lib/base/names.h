#pragma once

// Names of enumeration values, as options, records and command lines spell them. The names are declared next
// to the enumeration, in the order of its values, which count from 0:
//
//   enum class Robust { huber, geman_mcclure_gnc, none };
//   constexpr Names<3> names_of(Robust) { return {"huber", "geman_mcclure_gnc", "none"}; }

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {

template <size_t n>
using Names = std::array<std::string_view, n>;

template <typename E>
concept Named = std::is_enum_v<E> && requires(E value) {
  names_of(value);
};

template <Named E>
constexpr std::string_view to_string(E value) {
  return names_of(value).at(static_cast<size_t>(value));
}

template <Named E>
constexpr std::optional<E> find_name(std::string_view name) {
  const auto names = names_of(E{});
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? std::nullopt : std::optional(static_cast<E>(at - names.begin()));
}

/// Returns "did you mean 'huber'? known: huber, geman_mcclure_gnc, none".
template <Named E>
std::string suggest_name(std::string_view word) {
  const auto names = names_of(E{});
  return suggest(word, std::vector<std::string>(names.begin(), names.end()));
}

/// Returns the value with this name. Throws Error "unknown KIND 'NAME': did you mean ..." if there is none.
template <Named E>
E from_name(std::string_view name, std::string_view kind) {
  const std::optional<E> value = find_name<E>(name);
  if (!value) fail("unknown {} '{}': {}", kind, name, suggest_name<E>(name));
  return *value;
}

// Lookup in explicit tables of named entries (adapters, estimators, tables, ...). Entries do not register
// themselves in static initialisers, because the linker drops object files of a static library that nothing
// refers to. To add an entry, write one new file and one line in the table (registry.cc of the folder, or the
// file that calls find_entry()).

/// Returns the entry called `name` of a table whose entries have a member `name`. If there is none, throws
/// Error with the nearest name and all known names; `kind` appears in the message: "unknown estimator
/// 'join_flow': did you mean ...".
template <typename Entry>
const Entry& find_entry(std::span<const Entry> table, std::string_view name, std::string_view kind) {
  std::vector<std::string> names;
  for (const Entry& entry : table) {
    if (entry.name == name) return entry;
    names.emplace_back(entry.name);
  }
  fail("unknown {} '{}': {}", kind, name, suggest(name, names));
}

}  // namespace sextant
