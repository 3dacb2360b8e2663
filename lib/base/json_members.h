#pragma once

#include <string>
#include <utility>

#include "sextant/base/json.h"

namespace sextant {

/// Adds a member whose key the object does not have, in constant time: [] looks through all keys for it. Returns the value,
/// which stays in its place until the next member is added.
inline Json* append_member(Json& object, std::string key, Json value) {
  auto& members = static_cast<Json::object_t::Container&>(object.get_ref<Json::object_t&>());
  return &members.emplace_back(std::move(key), std::move(value)).second;
}

}  // namespace sextant
