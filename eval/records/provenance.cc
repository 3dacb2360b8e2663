#include <fstream>
#include <thread>

#include <build_info.h>
#include "sextant/eval/records/output.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

/// "model name" of /proc/cpuinfo, where there is one.
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

}  // namespace sextant
