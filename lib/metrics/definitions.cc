#include "sextant/metrics/definitions.h"

#include <vector>

#include "sextant/metrics/presets.h"

namespace sextant {
namespace {

const std::vector<MetricDefinition>& table() {
  static const std::vector<MetricDefinition> definitions = {
      {"Et_m", 1, "m", "translation of the pose change error; objects: motion in the camera frame"},
      {"ER_deg", 1, "deg", "rotation angle of the pose change error; objects: motion in the camera frame"},
      {"Et_world_m", 1, "m", "translation of the pose change error of the object's motion in the world"},
      {"ER_world_deg", 1, "deg", "rotation of the pose change error of the object's motion in the world"},
      {"Et_body_m", 1, "m", "translation of the pose change error of the object's motion in its own frame"},
      {"ER_body_deg", 1, "deg", "rotation of the pose change error of the object's motion in its own frame"},
      {"Ev_kmh", 1, "km/h", "absolute difference of v_kmh and v_gt_kmh"},
      {"Ev_origin_kmh", 1, "km/h", "absolute difference of v_kmh and v_gt_origin_kmh"},
      {"epe_measured_px", 1, "px", "mean end-point error of the measured flow over all points", true},
      {"epe_measured_x_px", 1, "px", "mean absolute horizontal error of the measured flow", true},
      {"epe_measured_y_px", 1, "px", "mean absolute vertical error of the measured flow", true},
      {"epe_initial_px", 1, "px", "mean end-point error of the measured flow over the inliers", true},
      {"epe_initial_x_px", 1, "px", "mean absolute horizontal error of the measured flow", true},
      {"epe_initial_y_px", 1, "px", "mean absolute vertical error of the measured flow", true},
      {"epe_refined_px", 1, "px", "mean end-point error of the refined flow over the inliers"},
      {"epe_refined_x_px", 1, "px", "mean absolute horizontal error of the refined flow"},
      {"epe_refined_y_px", 1, "px", "mean absolute vertical error of the refined flow"},
  };
  return definitions;
}

}  // namespace

std::span<const MetricDefinition> metric_definitions() { return table(); }

Json metric_definitions_json() {
  Json json = Json::object();
  for (const MetricDefinition& d : table())
    json[d.name] = fmt::format("{}: {} [{}]", d.version, d.definition, d.unit);
  return json;
}

Json metric_presets_json() {
  Json json = Json::object();
  for (const MetricPreset& p : metric_presets()) {
    json[p.name] = fmt::format("{}{}, {}, {} against {}, {}",
                               p.version == 1 ? "" : fmt::format("{}: ", p.version), p.object_Et_key,
                               p.object_ER_key, p.velocity_key, p.velocity_truth_key, to_string(p.aggregate));
  }
  return json;
}

}  // namespace sextant
