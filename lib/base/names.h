#pragma once

// Enumerations whose values have names, as options, records and command lines spell them. The names stand
// beside the enumeration, in the order of its values, which count from 0:
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

/// "did you mean 'huber'? known: huber, geman_mcclure_gnc, none".
template <Named E>
std::string suggest_name(std::string_view word) {
  const auto names = names_of(E{});
  return suggest(word, std::vector<std::string>(names.begin(), names.end()));
}

/// Throws Error "unknown KIND 'NAME': did you mean ..." where no value has that name.
template <Named E>
E from_name(std::string_view name, std::string_view kind) {
  const std::optional<E> value = find_name<E>(name);
  if (!value) fail("unknown {} '{}': {}", kind, name, suggest_name<E>(name));
  return *value;
}

// An explicit table of named things (adapters, estimators, tables, ...): no static self-registration,
// which a static library drops. Add an entry = one new file and one line in the folder's registry.cc.

/// The entry called `name` of a table whose entries have a `name` member; throws Error with the nearest
/// and all known names. `kind` is used in the message: "unknown estimator 'join_flow': did you mean ...".
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
