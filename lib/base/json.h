#pragma once

// The only entry point for JSON: scripts/maintain/check_layers.py checks that no other code parses it.
// Invalid JSON, a number outside the range of a double, a repeated key and more than max_json_depth levels
// throw Error with file and line. Members are read by type; Errors name file and key.

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

/// Largest nesting depth of objects and lists that is accepted; the project's own files have fewer than ten
/// levels.
constexpr size_t max_json_depth = 100;

/// Parses `text`. Error messages begin with "NAME:LINE: ", where `name` is the file that contains the text
/// and `first_line` the line of the file on which the text begins.
Json parse_json(std::string_view text, const std::string& name, int first_line = 1);
/// Parses a JSON file of at most json_file.max_bytes (base/files.h).
Json read_json(const std::filesystem::path& path);
/// Parses `text`; nullopt if it is not valid. For files that are regenerated in that case.
std::optional<Json> try_parse_json(std::string_view text);

/// Formats a value as the content of a file: indented by two blanks, with a newline at the end. Bytes that
/// are not UTF-8 become U+FFFD, and control characters of bidirectional text are escaped.
std::string json_text(const Json& value);
/// Formats a value like json_text(), but on one line and without a newline.
std::string json_line(const Json& value);
/// Returns json_line() for messages; a longer text than 80 bytes is cut there and ends in " ...".
std::string json_excerpt(const Json& value);

namespace internal {

/// Stores `value` in `field` and returns null. If the value has another type or is out of range, leaves
/// `field` unchanged and returns a description of the expected value ("a text").
const char* read_value(const Json& value, bool& field);
const char* read_value(const Json& value, int& field);
const char* read_value(const Json& value, int64_t& field);
const char* read_value(const Json& value, uint64_t& field);
const char* read_value(const Json& value, double& field);  ///< finite
const char* read_value(const Json& value, std::string& field);

/// Returns the member `key` of an object, null if it has none. Throws Error unless `object` is an object.
const Json* find_member(const Json& object, const std::string& key, const std::string& where);
[[noreturn]] void wrong_member(const std::string& key, const char* expected, const Json& value,
                               const std::string& where);

}  // namespace internal

/// Returns the member `key` of an object. Throws Error "WHERE: key 'KEY': expected a text, got 3" if its type
/// is wrong, and Error that begins with `where` if the member is missing or `object` is not an object. T:
/// bool, int, int64_t, uint64_t, double, std::string.
template <typename T>
T json_member(const Json& object, const std::string& key, const std::string& where);
/// Overload that returns `missing` if the object has no such member.
template <typename T>
T json_member(const Json& object, const std::string& key, const std::string& where, const T& missing);
/// Return a member that must be an object, or a list; empty if the object has no such member. Throw Error
/// like json_member() if the member has another type.
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

/// Adds a member whose key the object does not contain yet, in constant time; operator[] would search all
/// keys. Returns a pointer to the value, which is valid until the next member is added.
inline Json* append_member(Json& object, std::string key, Json value) {
  auto& members = static_cast<Json::object_t::Container&>(object.get_ref<Json::object_t&>());
  return &members.emplace_back(std::move(key), std::move(value)).second;
}

}  // namespace sextant
