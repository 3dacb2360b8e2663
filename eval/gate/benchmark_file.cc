#include "sextant/eval/gate/benchmark_file.h"

#include <cmath>

namespace sextant {
namespace {

double nanoseconds(const Json& entry, const std::string& where) {
  const std::string unit = entry.value("time_unit", std::string("ns"));
  if (unit == "ns") return 1;
  if (unit == "us") return 1e3;
  if (unit == "ms") return 1e6;
  if (unit == "s") return 1e9;
  fail("{}: time_unit '{}': expected ns, us, ms or s", where, unit);
}

double time_of(const Json& entry, const char* key, const std::string& where) {
  const auto it = entry.find(key);
  if (it == entry.end() || !it->is_number()) {
    fail("{}: '{}': expected a number, got {}", where, key, it == entry.end() ? "nothing" : it->dump());
  }
  const auto value = it->get<double>();
  if (!std::isfinite(value) || value < 0) fail("{}: '{}' = {}: must be a time >= 0", where, key, value);
  return value * nanoseconds(entry, where);
}

std::string text_of(const Json& entry, const char* key) {
  const auto it = entry.find(key);
  return it != entry.end() && it->is_string() ? it->get<std::string>() : "";
}

}  // namespace

BenchmarkFile parse_benchmark_file(std::string_view text, const std::string& name) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) fail("{}: not valid JSON: cut off, or a NaN in it", name);
  if (!json.is_object() || !json.contains("benchmarks") || !json["benchmarks"].is_array()) {
    fail("{}: expected the JSON of Google Benchmark, with a list 'benchmarks'", name);
  }
  BenchmarkFile file;
  file.path = name;
  file.context = json.value("context", Json::object());
  BenchmarkFile aggregates;
  for (const Json& entry : json["benchmarks"]) {
    if (!entry.is_object()) fail("{}: 'benchmarks': expected objects, got {}", name, entry.dump());
    std::string benchmark = text_of(entry, "run_name");
    if (benchmark.empty()) benchmark = text_of(entry, "name");
    if (benchmark.empty()) fail("{}: a benchmark has no 'name'", name);
    const std::string where = fmt::format("{}: benchmark '{}'", name, benchmark);
    if (entry.value("error_occurred", false)) fail("{}: failed: {}", where, text_of(entry, "error_message"));
    const bool is_aggregate = text_of(entry, "run_type") == "aggregate";
    if (is_aggregate && text_of(entry, "aggregate_name") != "median") continue;
    BenchmarkFile& target = is_aggregate ? aggregates : file;
    target.cpu_ns[benchmark].push_back(time_of(entry, "cpu_time", where));
    target.real_ns[benchmark].push_back(time_of(entry, "real_time", where));
  }
  file.cpu_ns.merge(aggregates.cpu_ns);  // keeps what is there
  file.real_ns.merge(aggregates.real_ns);
  if (file.cpu_ns.empty()) fail("{}: holds no benchmark", name);
  return file;
}

}  // namespace sextant
