#include "sextant/eval/records/record.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

using internal::FieldRule;

class Writer {
 public:
  template <typename T, typename... Rule>
  void field(const char* name, const T& value, const Rule&...) {
    json[name] = written(value);
  }
  template <typename T>
  void only_if(bool is_there, const char* name, const T& value, const char*) {
    if (is_there) field(name, value);
  }
  void unless_empty(const char* name, Interned value, const FieldRule<std::string_view>&) {
    if (!value.empty()) field(name, value);
  }
  Json json = {{"schema", internal::record_schema}};

 private:
  template <typename T>
  static Json written(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      return std::string(to_string(value));
    } else if constexpr (std::is_same_v<T, Interned>) {
      return value.str();
    } else if constexpr (std::is_same_v<T, Record::Numbers>) {
      Json numbers = Json::object();
      for (const auto& [key, number] : value) {
        if (std::isfinite(number)) numbers[key.str()] = number;
      }
      return numbers;
    } else {
      return value;
    }
  }
};

/// Reads a record from JSON; its error messages begin with `where`.
class StrictReader {
 public:
  StrictReader(const Json& json, const std::string& where) : json_(json), where_(where) {
    if (!json.is_object()) fail("{}: expected a JSON object, got {}", where, json.type_name());
    for (const auto& item : json.items()) {
      const std::vector<std::string>& keys = record_field_names();
      if (std::ranges::find(keys, item.key()) == keys.end())
        fail("{}: unknown key '{}': {}", where, item.key(), suggest(item.key(), keys));
    }
    const int schema = json_member<int>(json, "schema", where);
    if (schema != internal::record_schema)
      fail("{}: has schema {}, but this program reads schema {}", where, schema, internal::record_schema);
  }

  template <typename T>
  void field(const char* name, T& value) {
    if constexpr (std::is_enum_v<T>) {
      const auto text = json_member<std::string>(json_, name, where_);
      if (const char* expected = internal::from_text(text, value))
        fail("{}: unknown {} '{}': expected {}", where_, name, text, expected);
    } else if constexpr (std::is_same_v<T, Record::Numbers>) {
      value = numbers(name);
    } else if constexpr (std::is_same_v<T, Interned>) {
      value = json_member<std::string>(json_, name, where_);
    } else {
      value = json_member<T>(json_, name, where_);
    }
  }

  template <typename T, typename Value>
  void field(const char* name, T& value, const FieldRule<Value>& rule) {
    field(name, value);
    if (rule.allows(value)) return;
    const char* quote = std::is_same_v<T, Interned> ? "'" : "";
    fail("{}: key '{}': expected {}, got {}{}{}", where_, name, rule.expected, quote, value, quote);
  }

  template <typename T>
  void only_if(bool is_there, const char* name, T& value, const char* why) {
    if (json_.contains(name) != is_there) fail("{}: key '{}' {}", where_, name, why);
    if (is_there) field(name, value);
  }

  void unless_empty(const char* name, Interned& value, const FieldRule<std::string_view>& rule) {
    if (json_.contains(name)) field(name, value, rule);
  }

 private:
  Record::Numbers numbers(const char* name) const {
    if (!json_.contains(name)) fail("{}: key '{}' is missing", where_, name);
    const Json value = json_object(json_, name, where_);
    Record::Numbers result;
    for (const auto& item : value.items()) {
      if (const char* expected = internal::read_value(item.value(), result[item.key()]))
        internal::wrong_member(fmt::format("{}.{}", name, item.key()), expected, item.value(), where_);
      if (!internal::is_number_of(name, result.at(item.key()))) {
        const bool is_error = std::string_view(name) == "errors";
        const std::string expected =
            fmt::format("{} {} to be {}{}", is_error ? "error" : "number", item.key(),
                        internal::expected_number, is_error ? ", not negative" : "");
        internal::wrong_member(fmt::format("{}.{}", name, item.key()), expected.c_str(), item.value(),
                               where_);
      }
    }
    return result;
  }

  const Json& json_;
  const std::string& where_;
};

}  // namespace

std::string object_body(int id) { return "object:" + std::to_string(id); }

const Record::Numbers& Record::numbers(NumberMap map) const {
  const std::array<const Numbers*, 4> maps = {&errors, &values, &bound, &time_ms};
  return *maps.at(static_cast<size_t>(map));
}

std::vector<std::string> unlisted_keys(const std::vector<Record>& records) {
  std::set<std::string> unlisted;
  for (const Record& record : records) {
    for (const NumberMap map : {NumberMap::errors, NumberMap::values, NumberMap::bound, NumberMap::time_ms}) {
      for (const auto& [key, number] : record.numbers(map)) {
        if (find_metric(map, key.str()) == nullptr)
          unlisted.insert(fmt::format("{}.{}", to_string(map), key));
      }
    }
  }
  return {unlisted.begin(), unlisted.end()};
}

void check_listed(const std::vector<Record>& records) {
  const std::vector<std::string> unlisted = unlisted_keys(records);
  if (!unlisted.empty())
    throw InternalError(fmt::format("a record has keys that are missing in lib/metrics/definitions.cc: {}",
                                    fmt::join(unlisted, ", ")));
}

const std::vector<std::string>& record_field_names() {
  static const std::vector<std::string> names = [] {
    Record whole;  // with every optional field
    whole.status = Status::gated;
    whole.flow_truth = "given";
    std::vector<std::string> keys;
    const Json line = to_json(whole);
    for (const auto& item : line.items()) keys.push_back(item.key());
    return keys;
  }();
  return names;
}

Json to_json(const Record& record) {
  SEXTANT_CHECK(std::isfinite(record.level));
  Writer writer;
  internal::visit_fields(record, writer);
  return std::move(writer.json);
}

Record record_from_json(const Json& json, const std::string& where) {
  StrictReader reader(json, where);
  Record record;
  internal::visit_fields(record, reader);
  return record;
}

Record strip_times(Record record) {
  record.time_ms.clear();
  record.values.erase("peak_memory_mb");
  return record;
}

namespace {

/// An end-point error is relative to the true flow, which may be known without the true motion.
bool has_error_of_motion(const Record& record) {
  return std::ranges::any_of(record.errors,
                             [](const auto& error) { return !error.first.str().starts_with("epe_"); });
}

}  // namespace

bool lacks_errors(const Record& record) {
  return record.status == Status::ok && !has_error_of_motion(record);
}

bool has_truth(const Record& record) {
  if (record.is_ego()) return record.values.contains("step_gt_m");
  const auto dynamic = record.values.find("dynamic_gt");
  if (dynamic != record.values.end() && dynamic->second == 0) return false;
  return record.values.contains("distance_gt_m") || record.values.contains("v_gt_kmh") ||
         has_error_of_motion(record);
}

int body_order(Interned body) {
  return body == "ego" ? 0 : std::stoi(body.str().substr(body.str().find(':') + 1));
}

void put(const PoseChangeError& error, const std::string& frame, Record::Numbers& numbers) {
  numbers["Et" + frame + "_m"] = error.Et_m;
  numbers["ER" + frame + "_deg"] = error.ER_deg;
}

namespace internal {
bool is_body(std::string_view text) {
  constexpr std::string_view prefix = "object:";
  if (text == "ego") return true;
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return is_digits(text) && whole_number<int>(text);
}

bool is_flow_truth(std::string_view text) { return text == "given" || text == "induced"; }

bool is_count(int n) { return n >= 0; }

bool is_number_of(std::string_view map, double value) {
  return is_number(value) && !(value < 0 && map == to_string(NumberMap::errors));
}

const char* from_text(std::string_view text, Status& status) {
  const std::optional<Status> known = find_name<Status>(text);
  if (known) status = *known;
  return known ? nullptr : "a status of docs/metrics.md";
}

const char* from_text(std::string_view text, Gate& gate) {
  const std::optional<Gate> known = find_name<Gate>(text);
  if (!known || *known == Gate::none) return "distance, area or static";
  gate = *known;
  return nullptr;
}
}  // namespace internal

}  // namespace sextant
