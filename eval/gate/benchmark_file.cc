#include "sextant/eval/gate/benchmark_file.h"

namespace sextant {
namespace {

double nanoseconds(const Json& entry, const std::string& where) {
  const auto unit = json_member<std::string>(entry, "time_unit", where, "ns");
  if (unit == "ns") return 1;
  if (unit == "us") return 1e3;
  if (unit == "ms") return 1e6;
  if (unit == "s") return 1e9;
  fail("{}: time_unit '{}': expected ns, us, ms or s", where, unit);
}

double time_of(const Json& entry, const char* key, const std::string& where) {
  constexpr double shortest = 1e-100, longest = 1e100;  // keeps ratios and products of times finite
  const auto value = json_member<double>(entry, key, where);
  if (value != 0 && !(value >= shortest && value <= longest))
    fail("{}: '{}' = {}: expected 0 or a time from 1e-100 to 1e100", where, key, value);
  return value * nanoseconds(entry, where);
}

std::string text_of(const Json& entry, const char* key) {
  const auto it = entry.find(key);
  return it != entry.end() && it->is_string() ? it->get<std::string>() : "";
}

}  // namespace

BenchmarkFile parse_benchmark_file(std::string_view text, const std::string& name) {
  const Json json = parse_json(text, name);
  if (!json.is_object() || !json.contains("benchmarks") || !json["benchmarks"].is_array()) {
    fail("{}: expected the JSON of Google Benchmark, with a list 'benchmarks'", name);
  }
  BenchmarkFile file{.path = name, .context = json_object(json, "context", name)};
  json_member<std::string>(file.context, "executable", name + ": context", "");
  BenchmarkFile aggregates;
  for (const Json& entry : json["benchmarks"]) {
    if (!entry.is_object()) fail("{}: 'benchmarks': expected objects, got {}", name, json_excerpt(entry));
    std::string benchmark = text_of(entry, "run_name");
    if (benchmark.empty()) benchmark = text_of(entry, "name");
    if (benchmark.empty()) fail("{}: a benchmark has no 'name'", name);
    const std::string where = fmt::format("{}: benchmark '{}'", name, benchmark);
    if (json_member<bool>(entry, "error_occurred", where, false))
      fail("{}: failed: {}", where, text_of(entry, "error_message"));
    const bool is_aggregate = text_of(entry, "run_type") == "aggregate";
    if (is_aggregate && text_of(entry, "aggregate_name") != "median") continue;
    BenchmarkFile& target = is_aggregate ? aggregates : file;
    target.cpu_ns[benchmark].push_back(time_of(entry, "cpu_time", where));
    target.real_ns[benchmark].push_back(time_of(entry, "real_time", where));
  }
  file.cpu_ns.merge(aggregates.cpu_ns);  // does not overwrite repetitions
  file.real_ns.merge(aggregates.real_ns);
  if (file.cpu_ns.empty()) fail("{}: holds no benchmark", name);
  return file;
}

}  // namespace sextant
