#include "sextant/eval/records/record.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/record_scanner.h"

namespace sextant {
namespace {

constexpr int schema = 1;

const std::vector<std::string>& known_keys() {
  static const std::vector<std::string> keys = {
      "schema", "dataset", "sequence", "estimator", "noise",      "level",  "seed",   "frame", "body",
      "status", "gate",    "n_points", "n_inliers", "flow_truth", "errors", "values", "bound", "time_ms"};
  return keys;
}

Json numbers_to_json(const Record::Numbers& numbers) {
  Json json = Json::object();
  for (const auto& [key, value] : numbers) {
    if (std::isfinite(value)) json[key] = value;
  }
  return json;
}

/// Typed access to the keys of one line, with messages that say where.
class LineReader {
 public:
  LineReader(const Json& json, const std::string& where) : json_(json), where_(where) {
    if (!json.is_object()) fail("{}: expected a JSON object, got {}", where, json.type_name());
    for (const auto& item : json.items()) {
      const auto& keys = known_keys();
      if (std::find(keys.begin(), keys.end(), item.key()) == keys.end()) {
        fail("{}: unknown key '{}': {}", where, item.key(), suggest(item.key(), keys));
      }
    }
  }

  bool has(const char* key) const { return json_.contains(key); }

  std::string text(const char* key) const { return json_member<std::string>(json_, key, where_); }
  int integer(const char* key) const { return json_member<int>(json_, key, where_); }
  uint64_t seed(const char* key) const { return json_member<uint64_t>(json_, key, where_); }
  double number(const char* key) const { return json_member<double>(json_, key, where_); }

  int count(const char* key) const {
    const int value = integer(key);
    if (value < 0) fail("{}: key '{}': expected a count >= 0, got {}", where_, key, value);
    return value;
  }

  Record::Numbers numbers(const char* key) const {
    if (!has(key)) fail("{}: key '{}' is missing", where_, key);
    const Json value = json_object(json_, key, where_);
    Record::Numbers result;
    for (const auto& item : value.items()) {
      if (const char* expected = internal::read_value(item.value(), result[item.key()]))
        internal::wrong_member(fmt::format("{}.{}", key, item.key()), expected, item.value(), where_);
    }
    return result;
  }

 private:
  const Json& json_;
  const std::string& where_;
};

Gate gate_from_string(const std::string& name, const std::string& where) {
  if (const std::optional<Gate> gate = find_gate(name)) return *gate;
  fail("{}: unknown gate '{}': expected distance, area or static", where, name);
}

void check_body(const std::string& body, const std::string& where) {
  if (!is_body(body)) fail("{}: key 'body': expected ego or object:ID, got '{}'", where, body);
}

}  // namespace

std::string object_body(int id) { return "object:" + std::to_string(id); }

Json to_json(const Record& r) {
  SEXTANT_CHECK(std::isfinite(r.level));
  Json json = Json::object();
  json["schema"] = schema;
  json["dataset"] = r.dataset;
  json["sequence"] = r.sequence;
  json["estimator"] = r.estimator;
  json["noise"] = r.noise;
  json["level"] = r.level;
  json["seed"] = r.seed;
  json["frame"] = r.frame;
  json["body"] = r.body;
  json["status"] = std::string(to_string(r.status));
  if (r.status == Status::gated) json["gate"] = std::string(to_string(r.gate));
  json["n_points"] = r.n_points;
  json["n_inliers"] = r.n_inliers;
  if (!r.flow_truth.empty()) json["flow_truth"] = r.flow_truth;
  json["errors"] = numbers_to_json(r.errors);
  json["values"] = numbers_to_json(r.values);
  json["bound"] = numbers_to_json(r.bound);
  json["time_ms"] = numbers_to_json(r.time_ms);
  return json;
}

Record record_from_json(const Json& json, const std::string& where) {
  const LineReader line(json, where);
  if (line.integer("schema") != schema) {
    fail("{}: schema {}, but this program reads schema {}", where, line.integer("schema"), schema);
  }
  Record r;
  r.dataset = line.text("dataset");
  r.sequence = line.text("sequence");
  r.estimator = line.text("estimator");
  r.noise = line.text("noise");
  r.level = line.number("level");
  r.seed = line.seed("seed");
  r.frame = line.integer("frame");
  r.body = line.text("body");
  check_body(r.body, where);
  try {
    r.status = from_name<Status>(line.text("status"), "status");
  } catch (const Error& error) {
    fail("{}: {}", where, error.what());
  }
  if (line.has("gate") != (r.status == Status::gated)) {
    fail("{}: key 'gate' belongs to status 'gated' and to no other", where);
  }
  if (line.has("gate")) r.gate = gate_from_string(line.text("gate"), where);
  r.n_points = line.count("n_points");
  r.n_inliers = line.count("n_inliers");
  if (line.has("flow_truth")) {
    r.flow_truth = line.text("flow_truth");
    if (r.flow_truth != "given" && r.flow_truth != "induced") {
      fail("{}: key 'flow_truth': expected given or induced, got '{}'", where, r.flow_truth);
    }
  }
  r.errors = line.numbers("errors");
  r.values = line.numbers("values");
  r.bound = line.numbers("bound");
  r.time_ms = line.numbers("time_ms");
  return r;
}

std::string write_records(const std::vector<Record>& records) {
  std::string text;
  for (const Record& record : records) {
    text += json_line(to_json(record));
    text += '\n';
  }
  return text;
}

std::vector<Record> parse_records(std::string_view text, const std::string& name) {
  std::vector<Record> records;
  records.reserve(static_cast<size_t>(std::ranges::count(text, '\n')));
  int line_number = 0;
  while (!text.empty()) {
    const auto where = [&, number = ++line_number] { return fmt::format("{}:{}", name, number); };
    const size_t end = text.find('\n');
    if (end == std::string_view::npos) {
      fail("{}: the line is not finished: the file is truncated; repeat the run that wrote it", where());
    }
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (std::optional<Record> record = scan_record(line)) {
      records.push_back(std::move(*record));
      continue;
    }
    records.push_back(record_from_json(parse_json(line, name, line_number), where()));
  }
  return records;
}

std::vector<Record> read_records(const std::filesystem::path& path) {
  return parse_records(read_file(path, records_file), path.string());
}

Record strip_times(Record record) {
  record.time_ms.clear();
  record.values.erase("peak_memory_mb");
  return record;
}

}  // namespace sextant
