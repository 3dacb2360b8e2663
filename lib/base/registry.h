#pragma once

// An explicit table of named things (adapters, estimators, tables, ...): no static self-registration,
// which a static library drops. Add an entry = one new file and one line in the folder's registry.cc.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {

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
