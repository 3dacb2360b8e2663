#pragma once

// The one door through which JSON comes in; scripts/maintain/check_layers.py sees to it that there is no
// other. What is not JSON, a number that no double holds, a key that is there twice and more than
// max_json_depth levels are Errors with file and line. Members are read by type; Errors name file and key.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "sextant/base/error.h"

namespace sextant {

using Json = nlohmann::ordered_json;

/// Levels of objects and lists within one another; what this program writes has fewer than ten.
constexpr size_t max_json_depth = 100;

/// `name` is the file, or whatever holds the text, in messages: "NAME:LINE: not valid JSON ..."; `first_line`
/// is the line there at which the text begins.
Json parse_json(std::string_view text, const std::string& name, int first_line = 1);
/// Of a file; see json_file in base/files.h for the largest.
Json read_json(const std::filesystem::path& path);
/// Nothing when it is not valid: for files that are made again then.
std::optional<Json> try_parse_json(std::string_view text);

/// As the content of a file: indented by two, a newline at the end. Bytes that are no UTF-8 become U+FFFD.
std::string json_text(const Json& value);
/// On one line, without the newline.
std::string json_line(const Json& value);
/// The beginning of json_line(): for messages.
std::string json_excerpt(const Json& value);

namespace internal {

/// Sets `field`; or returns what would be right ("a text"), and leaves it.
const char* read_value(const Json& value, bool& field);
const char* read_value(const Json& value, int& field);
const char* read_value(const Json& value, int64_t& field);
const char* read_value(const Json& value, uint64_t& field);
const char* read_value(const Json& value, double& field);  ///< finite
const char* read_value(const Json& value, std::string& field);

/// Throws Error unless `object` is an object; null when it has no such member.
const Json* find_member(const Json& object, const std::string& key, const std::string& where);
[[noreturn]] void wrong_member(const std::string& key, const char* expected, const Json& value,
                               const std::string& where);

}  // namespace internal

/// The member `key` of an object. Throws Error "WHERE: key 'KEY': expected a text, got 3", also when it is
/// missing or `object` is no object. T: bool, int, int64_t, uint64_t, double, std::string.
template <typename T>
T json_member(const Json& object, const std::string& key, const std::string& where);
/// The same with a value for where it is missing.
template <typename T>
T json_member(const Json& object, const std::string& key, const std::string& where, const T& missing);
/// A member that is an object or a list; an empty one where it is missing.
Json json_object(const Json& object, const std::string& key, const std::string& where);
Json json_list(const Json& object, const std::string& key, const std::string& where);

// ---- implementation

template <typename T>
T json_member(const Json& object, const std::string& key, const std::string& where) {
  const Json* value = internal::find_member(object, key, where);
  if (value == nullptr) fail("{}: key '{}' is missing", where, key);
  T field{};
  if (const char* expected = internal::read_value(*value, field))
    internal::wrong_member(key, expected, *value, where);
  return field;
}

template <typename T>
T json_member(const Json& object, const std::string& key, const std::string& where, const T& missing) {
  return internal::find_member(object, key, where) == nullptr ? missing : json_member<T>(object, key, where);
}

/// Adds a member whose key the object does not have, in constant time: [] looks through all keys for it.
/// Returns the value, which stays in its place until the next member is added.
inline Json* append_member(Json& object, std::string key, Json value) {
  auto& members = static_cast<Json::object_t::Container&>(object.get_ref<Json::object_t&>());
  return &members.emplace_back(std::move(key), std::move(value)).second;
}

}  // namespace sextant
