#include "sextant/base/json.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

/// Iterator over the characters of the text; `*seen` points behind the last character that was read.
struct Cursor {
  using iterator_category = std::forward_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  const char* at;
  const char** seen;

  const char& operator*() const { return *at; }
  Cursor& operator++() {
    *seen = ++at;
    return *this;
  }
  bool operator==(const Cursor& other) const { return at == other.at; }
};

/// SAX handler that builds the value, or records why it could not.
class Builder final : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return put(Json()); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(number_integer_t value) override { return put(value); }
  bool number_unsigned(number_unsigned_t value) override { return put(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return put(value); }
  bool string(string_t& value) override { return put(std::move(value)); }
  bool binary(binary_t& /*value*/) override { return false; }  // JSON text contains no binary values

  bool start_object(size_t /*size*/) override { return open(Json::object()); }
  bool end_object() override { return close(); }
  bool start_array(size_t /*size*/) override { return open(Json::array()); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    if (!open_.back().add_key(name)) {
      problem_ = fmt::format("key '{}' is repeated", one_line(name));
      return false;
    }
    key_ = std::move(name);
    return true;
  }

  bool parse_error(size_t position, const std::string& token,
                   const nlohmann::detail::exception& error) override {
    n_read_ = position;
    constexpr int number_overflow = 406;
    if (error.id == number_overflow)
      problem_ = fmt::format("the number {} is outside the range of a double", one_line(token.substr(0, 40)));
    return false;
  }

  Json take() { return std::move(root_); }
  const std::string& problem() const { return problem_; }
  /// Number of characters read up to the first invalid one; the end of the text counts as one.
  size_t n_read() const { return n_read_; }

 private:
  /// A list or object whose end has not been read yet.
  struct Open {
    Json* value;
    std::unordered_set<std::string> keys{};  ///< of an object with at least few_keys keys; else empty

    /// Returns false if the key is already present. Json searches all keys of an object linearly, which would
    /// be quadratic for objects with many keys.
    bool add_key(const std::string& name) {
      constexpr size_t few_keys = 32;
      const auto& items = value->get_ref<const Json::object_t&>();
      if (items.size() < few_keys) return !value->contains(name);
      if (keys.empty()) {
        for (const auto& item : items) keys.insert(item.first);
      }
      return keys.insert(name).second;
    }
  };

  Json* insert(Json value) {
    if (open_.empty()) {
      root_ = std::move(value);
      return &root_;
    }
    Json& parent = *open_.back().value;
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return append_member(parent, std::move(key_), std::move(value));
  }
  bool put(Json value) {
    insert(std::move(value));
    return true;
  }
  // An open value is the last child of the open value before it, so its address does not change.
  bool open(Json value) {
    if (open_.size() == max_json_depth) {
      problem_ = fmt::format("more than {} levels of objects and lists", max_json_depth);
      return false;
    }
    open_.push_back({insert(std::move(value))});
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  Json root_;
  std::vector<Open> open_;
  std::string key_;
  std::string problem_;
  size_t n_read_ = 0;
};

/// Dumps a value with the control characters of bidirectional text escaped, since JSON is also printed to
/// terminals; the escapes read back to the same text.
std::string dumped(const Json& value, int indent) {
  std::string text = value.dump(indent, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
  for (size_t at = text.find("\xe2"); at != std::string::npos; at = text.find("\xe2", at + 1)) {
    const std::string sign = text.substr(at, 3), code = with_directions_shown(sign);
    if (code != sign) text.replace(at, 3, fmt::format("\\u{}", code.substr(2)));
  }
  return text;
}

/// Reads an integer into `field`; `range` describes the type in messages: "an integer" or "a 32-bit integer".
template <typename T>
const char* read_integer(const Json& value, T& field, const char* range) {
  if (!value.is_number_integer()) return "an integer";
  if (value.is_number_unsigned()) {
    const auto wide = value.get<uint64_t>();
    if (wide > static_cast<uint64_t>(std::numeric_limits<T>::max())) return range;
    field = static_cast<T>(wide);
    return nullptr;
  }
  const auto wide = value.get<int64_t>();
  if (wide < std::numeric_limits<T>::min() || wide > std::numeric_limits<T>::max()) return range;
  field = static_cast<T>(wide);
  return nullptr;
}

}  // namespace

Json parse_json(std::string_view text, const std::string& name, int first_line) {
  const char* const begin = text.data();
  const char* seen = begin;
  Builder builder;
  if (Json::sax_parse(Cursor{begin, &seen}, Cursor{begin + text.size(), &seen}, &builder))
    return builder.take();
  const auto at = static_cast<size_t>(seen - begin);
  const size_t last = at > 0 ? at - 1 : 0;
  const auto line = first_line + std::count(begin, begin + last, '\n');
  const size_t line_begin = last > 0 ? text.rfind('\n', last - 1) : std::string_view::npos;
  const size_t column = last - (line_begin == std::string_view::npos ? 0 : line_begin + 1) + 1;
  if (!builder.problem().empty()) fail("{}:{}: {}", name, line, builder.problem());
  if (builder.n_read() > text.size()) fail("{}:{}: not valid JSON: it ends too early", name, line);
  fail("{}:{}: not valid JSON at column {}, near '{}'", name, line, column, one_line(text.substr(last, 20)));
}

Json read_json(const std::filesystem::path& path) {
  return parse_json(read_file(path, json_file), path.string());
}

std::optional<Json> try_parse_json(std::string_view text) {
  try {
    return parse_json(text, "");
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::string json_text(const Json& value) { return dumped(value, 2) + "\n"; }

std::string json_line(const Json& value) { return dumped(value, -1); }

std::string json_excerpt(const Json& value) {
  constexpr size_t longest = 80;
  const std::string text = one_line(json_line(value));
  return text.size() <= longest ? text : one_line(text.substr(0, longest)) + " ...";
}

Json json_object(const Json& object, const std::string& key, const std::string& where) {
  const Json* value = internal::find_member(object, key, where);
  if (value == nullptr) return Json::object();
  if (!value->is_object()) internal::wrong_member(key, "an object", *value, where);
  return *value;
}

Json json_list(const Json& object, const std::string& key, const std::string& where) {
  const Json* value = internal::find_member(object, key, where);
  if (value == nullptr) return Json::array();
  if (!value->is_array()) internal::wrong_member(key, "a list", *value, where);
  return *value;
}

namespace internal {

const char* read_value(const Json& value, bool& field) {
  if (!value.is_boolean()) return "true or false";
  field = value.get<bool>();
  return nullptr;
}

const char* read_value(const Json& value, int& field) {
  return read_integer(value, field, "a 32-bit integer");
}

const char* read_value(const Json& value, int64_t& field) {
  return read_integer(value, field, "a 64-bit integer");
}

const char* read_value(const Json& value, uint64_t& field) {
  if (!value.is_number_integer() || (!value.is_number_unsigned() && value.get<int64_t>() < 0))
    return "a non-negative integer";
  field = value.get<uint64_t>();
  return nullptr;
}

const char* read_value(const Json& value, double& field) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return "a finite number";
  field = value.get<double>();
  return nullptr;
}

const char* read_value(const Json& value, std::string& field) {
  if (!value.is_string()) return "a text";
  field = value.get<std::string>();
  return nullptr;
}

const Json* find_member(const Json& object, const std::string& key, const std::string& where) {
  if (!object.is_object()) fail("{}: expected an object, got {}", where, json_excerpt(object));
  const auto it = object.find(key);
  return it == object.end() ? nullptr : &*it;
}

void wrong_member(const std::string& key, const char* expected, const Json& value, const std::string& where) {
  fail("{}: key '{}': expected {}, got {}", where, key, expected, json_excerpt(value));
}

}  // namespace internal
}  // namespace sextant
