#include <fstream>
#include <thread>

#include <build_info.h>
#include "sextant/eval/experiment/output.h"
#include "sextant/eval/experiment/version.h"
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

Json source_json(const SourceRun& source) {
  Json json;
  json["source"] = source.source;
  json["dataset"] = source.info.dataset;
  json["sequence"] = source.info.sequence;
  json["first_frame"] = source.info.first_frame;
  json["last_frame"] = source.info.last_frame;
  json["rate_hz"] = source.info.rate_hz;
  json["width_px"] = source.info.width;
  json["height_px"] = source.info.height;
  const StereoCamera& camera = source.info.camera;
  json["camera"] = {{"fx_px", camera.left.fx},
                    {"fy_px", camera.left.fy},
                    {"cx_px", camera.left.cx},
                    {"cy_px", camera.left.cy},
                    {"bf_px_m", camera.bf}};
  json["provenance"] = source.info.provenance;
  json["warnings"] = source.info.warnings;
  json["estimated_poses"] = source.motions.estimated.poses().size();
  json["world_origin"] = source.motions.starts_at_truth ? "true pose of the first frame" : "first frame";
  if (!source.noise.is_null()) json["noise"] = source.noise;
  Json inputs = Json::object();
  for (const auto& [path, entry] : source.inputs)
    inputs[path] = {{"bytes", entry.bytes}, {"sha256", entry.sha256}};
  json["inputs"] = std::move(inputs);
  return json;
}

}  // namespace

std::string version() { return build_info::version; }
std::string git_commit() { return build_info::git_commit; }

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

Json run_provenance(const RunResult& result) {
  Json json = build_provenance();
  json["configuration"] = result.configuration;
  json["jobs"] = result.jobs;
  json["wall_time_s"] = result.wall_time_s;
  json["records"] = result.records.size();
  json["sources"] = Json::array();
  for (const SourceRun& source : result.sources) json["sources"].push_back(source_json(source));
  return json;
}

}  // namespace sextant
