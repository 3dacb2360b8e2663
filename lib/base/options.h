#pragma once

// Options are plain structs with defaults. Each field is declared once, with its type, name, default, unit
// and meaning. The members, the strict JSON reader (an unknown key is an error that names the nearest one),
// the JSON writer for provenance, and the help text follow from that list. Example:
//
//   struct RansacOptions {
//     SEXTANT_OPTIONS(
//         (int, max_iterations, 500, "count", "upper limit of samples"),
//         (double, inlier_threshold_px, 0.4, "px", "largest reprojection error of an inlier"))
//     void check() const {
//       check_option(max_iterations > 0, "max_iterations", max_iterations, "> 0");
//     }
//   };
//
// A field may itself be such a struct, with {} as its default. Supported leaf types: bool, int, uint64_t,
// double, std::string, and enumerations with names (base/names.h), whose names the help lists.
// std::map<std::string, T> is an object whose keys the user chooses; the check() of the struct that contains
// the object validates its keys, and reading replaces the whole map. SEXTANT_OPTIONS_OF(BASE, ...) continues
// the list of a base class. If a key differs from the member's name, the struct defines visit() itself, with
// one call v("default", other, "px", "meaning") per field.

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"

// Applies MACRO to each (FIELD) of a list of at most 64 fields.
#define SEXTANT_PARENTHESES ()
#define SEXTANT_SCAN(...) SEXTANT_SCAN_16(SEXTANT_SCAN_16(SEXTANT_SCAN_16(SEXTANT_SCAN_16(__VA_ARGS__))))
#define SEXTANT_SCAN_16(...) SEXTANT_SCAN_4(SEXTANT_SCAN_4(SEXTANT_SCAN_4(SEXTANT_SCAN_4(__VA_ARGS__))))
#define SEXTANT_SCAN_4(...) SEXTANT_SCAN_1(SEXTANT_SCAN_1(SEXTANT_SCAN_1(SEXTANT_SCAN_1(__VA_ARGS__))))
#define SEXTANT_SCAN_1(...) __VA_ARGS__
#define SEXTANT_FOR_EACH(MACRO, ...) SEXTANT_SCAN(SEXTANT_FOR_NEXT(MACRO, __VA_ARGS__))
#define SEXTANT_FOR_NEXT(MACRO, FIELD, ...) \
  MACRO FIELD __VA_OPT__(SEXTANT_FOR_REST SEXTANT_PARENTHESES(MACRO, __VA_ARGS__))
#define SEXTANT_FOR_REST() SEXTANT_FOR_NEXT
#define SEXTANT_DECLARE_OPTION(TYPE, NAME, DEFAULT, UNIT, MEANING) TYPE NAME = DEFAULT;
#define SEXTANT_VISIT_OPTION(TYPE, NAME, DEFAULT, UNIT, MEANING) v(#NAME, NAME, UNIT, MEANING);
#define SEXTANT_OPTIONS(...)                            \
  SEXTANT_FOR_EACH(SEXTANT_DECLARE_OPTION, __VA_ARGS__) \
  void visit(auto& v) { SEXTANT_FOR_EACH(SEXTANT_VISIT_OPTION, __VA_ARGS__) }
#define SEXTANT_OPTIONS_OF(BASE, ...)                   \
  SEXTANT_FOR_EACH(SEXTANT_DECLARE_OPTION, __VA_ARGS__) \
  void visit(auto& v) {                                 \
    BASE::visit(v);                                     \
    SEXTANT_FOR_EACH(SEXTANT_VISIT_OPTION, __VA_ARGS__) \
  }

namespace sextant {

namespace internal {

struct NoVisitor {
  template <typename T>
  void operator()(const char*, T&, const char*, const char*) {}
};

template <typename T>
concept OptionStruct = requires(T t, NoVisitor v) {
  t.visit(v);
};

[[noreturn]] inline void wrong_type(const std::string& where, const char* expected, const Json& value) {
  fail("option {}: expected {}, got {}", where, expected, json_excerpt(value));
}

/// Returns "huber, geman_mcclure_gnc or none".
inline std::string either_of(std::span<const std::string_view> names) {
  std::string text(names.front());
  for (size_t i = 1; i < names.size(); ++i)
    text += (i + 1 < names.size() ? ", " : " or ") + std::string(names[i]);
  return text;
}

}  // namespace internal

/// Throws Error "option NAME = VALUE: must be REQUIREMENT" unless `ok`.
template <typename T>
void check_option(bool ok, std::string_view name, const T& value, std::string_view requirement) {
  if (!ok) fail("option {} = {}: must be {}", name, value, requirement);
}

/// Overwrites the fields of `options` that `json` names. Strict: an unknown key, a wrong type or a value that
/// options.check() rejects throws Error; `where` is the prefix of the path in messages ("pipeline").
template <internal::OptionStruct T>
void read_options(const Json& json, T& options, const std::string& where = "");

/// Reads options from a JSON file; messages begin with the name of the file.
template <internal::OptionStruct T>
T options_from(const std::filesystem::path& path);

/// Returns all fields with their present values, as an object.
template <internal::OptionStruct T>
Json write_options(const T& options);

/// One option in the help text.
struct OptionHelp {
  std::string key;  ///< dotted path
  std::string default_value;
  std::string unit;
  std::string meaning;  ///< includes the names that an enumeration accepts
};

/// Returns every leaf option below `T`, with its value in `options`; `prefix` is the dotted path of `options`
/// itself. A map of options appears once, with the key NAME and the defaults of one entry.
template <internal::OptionStruct T>
std::vector<OptionHelp> describe_options(const T& options, const std::string& prefix = "");

// ---- implementation

namespace internal {

template <OptionStruct T>
void read_map(const Json& json, std::map<std::string, T>& field, const std::string& where) {
  if (!json.is_object()) wrong_type(where, "an object", json);
  field.clear();
  for (const auto& item : json.items())
    read_options(item.value(), field[item.key()], where + "." + item.key());
}

template <typename T>
struct MapValue {};
template <OptionStruct T>
struct MapValue<std::map<std::string, T>> {
  using type = T;
};
template <typename T>
concept OptionMap = requires {
  typename MapValue<T>::type;
};

struct Reader {
  const Json& json;
  const std::string& where;
  std::vector<std::string> known{};

  template <typename T>
  void operator()(const char* name, T& field, const char*, const char*) {
    known.emplace_back(name);
    const auto it = json.find(name);
    if (it == json.end()) return;
    const std::string path = where.empty() ? name : where + "." + name;
    if constexpr (OptionStruct<T>) {
      read_options(*it, field, path);
    } else if constexpr (OptionMap<T>) {
      read_map(*it, field, path);
    } else if constexpr (Named<T>) {
      std::string text;
      if (const char* expected = read_value(*it, text)) wrong_type(path, expected, *it);
      const std::optional<T> value = find_name<T>(text);
      if (!value) fail("option {} = {}: {}", path, text, suggest_name<T>(text));
      field = *value;
    } else {
      if (const char* expected = read_value(*it, field)) wrong_type(path, expected, *it);
    }
  }
};

struct Writer {
  Json json = Json::object();
  template <typename T>
  void operator()(const char* name, T& field, const char*, const char*) {
    if constexpr (OptionStruct<T>) {
      json[name] = write_options(field);
    } else if constexpr (OptionMap<T>) {
      json[name] = Json::object();
      for (const auto& [key, value] : field) json[name][key] = write_options(value);
    } else if constexpr (Named<T>) {
      json[name] = to_string(field);
    } else {
      json[name] = field;
    }
  }
};

struct Describer {
  const std::string& prefix;
  std::vector<OptionHelp> lines{};
  template <typename T>
  void operator()(const char* name, T& field, const char* unit, const char* meaning) {
    const std::string key = prefix.empty() ? name : prefix + "." + name;
    if constexpr (OptionStruct<T>) {
      for (OptionHelp& line : describe_options(field, key)) lines.push_back(std::move(line));
    } else if constexpr (OptionMap<T>) {
      using Value = typename MapValue<T>::type;
      for (OptionHelp& line : describe_options(Value{}, key + ".NAME")) lines.push_back(std::move(line));
    } else if constexpr (Named<T>) {
      lines.push_back({key, json_line(to_string(field)), unit,
                       fmt::format("{}: {}", meaning, either_of(names_of(field)))});
    } else {
      lines.push_back({key, json_line(field), unit, meaning});
    }
  }
};

}  // namespace internal

template <internal::OptionStruct T>
void read_options(const Json& json, T& options, const std::string& where) {
  if (!json.is_object()) internal::wrong_type(where.empty() ? "options" : where, "an object", json);
  internal::Reader reader{json, where};
  options.visit(reader);
  for (const auto& item : json.items()) {
    if (std::find(reader.known.begin(), reader.known.end(), item.key()) == reader.known.end()) {
      fail("unknown option key '{}{}{}': {}", where, where.empty() ? "" : ".", item.key(),
           suggest(item.key(), reader.known));
    }
  }
  if constexpr (requires { options.check(); }) {
    try {
      options.check();
    } catch (const Error& error) {
      const std::string_view message = error.what();
      constexpr std::string_view begin = "option ";
      if (where.empty() || !message.starts_with(begin)) throw;
      fail("{}{}.{}", begin, where, message.substr(begin.size()));
    }
  }
}

template <internal::OptionStruct T>
T options_from(const std::filesystem::path& path) {
  const Json json = read_json(path);
  T options;
  try {
    read_options(json, options);
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
  return options;
}

template <internal::OptionStruct T>
Json write_options(const T& options) {
  internal::Writer writer;
  const_cast<T&>(options).visit(writer);  // the writer only reads
  return writer.json;
}

template <internal::OptionStruct T>
std::vector<OptionHelp> describe_options(const T& options, const std::string& prefix) {
  internal::Describer describer{prefix};
  const_cast<T&>(options).visit(describer);  // the describer only reads
  return describer.lines;
}

// Base class that stores the checked options of a class and returns them as JSON for provenance.

/// `Interface` must declare `virtual Json options() const`.
template <typename Interface, typename Options>
class WithOptions : public Interface {
 public:
  explicit WithOptions(const Options& options) : options_(options) { options_.check(); }
  Json options() const override { return write_options(options_); }

 protected:
  Options options_;
};

}  // namespace sextant
