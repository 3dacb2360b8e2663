#include "sextant/eval/records/provenance.h"

#include <build_info.h>

#include <fstream>
#include <thread>

#include "sextant/base/error.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

/// Returns "model name" of /proc/cpuinfo, if available.
std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

std::string version() { return build_info::version; }
std::string git_commit() { return build_info::git_commit; }

Json program_identity() { return {{"version", version()}, {"git_commit", git_commit()}}; }

Json build_provenance() {
  Json json;
  json["schema"] = 1;
  json["version"] = version();
  json["git_commit"] = git_commit();
  json["compiler"] = build_info::compiler;
  json["flags"] = build_info::flags;
  json["packages"] = {{"Eigen", build_info::eigen},
                      {"OpenCV", build_info::opencv},
                      {"Ceres", build_info::ceres},
                      {"fmt", build_info::fmt},
                      {"nlohmann_json", build_info::nlohmann_json}};
  json["machine"] = {{"cpu", cpu_model()}, {"cores", std::thread::hardware_concurrency()}};
  json["metric_definitions"] = metric_definitions_json();
  json["metric_presets"] = metric_presets_json();
  return json;
}

namespace {

void check_inputs(const Json& owner, const std::string& where) {
  const Json inputs = json_object(owner, "inputs", where);
  for (const auto& [path, input] : inputs.items()) {
    if (!input.is_string()) json_member<std::string>(input, "sha256", fmt::format("{}: '{}'", where, path));
  }
}

}  // namespace

Json read_run_json(const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  Json run = read_json(file);
  for (const char* key : {"version", "git_commit", "compiler", "flags"})
    json_member<std::string>(run, key, file, "");
  json_member<uint64_t>(run, "cases", file, 0);
  const Json machine = json_object(run, "machine", file);
  json_member<std::string>(machine, "cpu", file + ": machine", "");
  json_member<int>(machine, "cores", file + ": machine", 0);
  const Json packages = json_object(run, "packages", file);
  for (const auto& item : packages.items())
    json_member<std::string>(packages, item.key(), file + ": packages");
  json_object(run, "configuration", file);
  check_inputs(run, file);
  for (const char* list : {"noise", "sources"}) {
    for (const Json& entry : json_list(run, list, file)) {
      const std::string where = fmt::format("{}: {}", file, list);
      json_member<std::string>(entry, "source", where, "");
      json_member<double>(entry, "level", where, 0);
      check_inputs(entry, where);
    }
  }
  return run;
}

}  // namespace sextant
