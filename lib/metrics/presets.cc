#include "sextant/metrics/presets.h"

#include <cmath>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/registry.h"

namespace sextant {
namespace {

const std::vector<MetricPreset>& table() {
  static const std::vector<MetricPreset> presets = {
      {"paper",
       "as the paper states: object motion in the camera frame, mean over steps, same velocity formula",
       "Et_m", "ER_deg", "Ev_kmh", "v_gt_kmh", Aggregate::mean},
      {"multimot_code",
       "as the published code: object motion in the estimate's world, velocity truth from the box origin",
       "Et_world_m", "ER_world_deg", "Ev_origin_kmh", "v_gt_origin_kmh", Aggregate::mean},
      {"vdo_slam", "VDO-SLAM: object motion in the body frame, mean over steps, same velocity formula",
       "Et_body_m", "ER_body_deg", "Ev_kmh", "v_gt_kmh", Aggregate::mean, 2},
      {"dynosam_rme", "DynOSAM relative motion error: body frame, RMSE", "Et_body_m", "ER_body_deg",
       "Ev_origin_kmh", "v_gt_origin_kmh", Aggregate::rmse},
      {"dynosam_ame", "DynOSAM absolute motion error: world frame, RMSE", "Et_world_m", "ER_world_deg",
       "Ev_origin_kmh", "v_gt_origin_kmh", Aggregate::rmse},
  };
  return presets;
}

}  // namespace

const std::string& MetricPreset::object_key(const std::string& metric) const {
  if (metric == "Et_m") return object_Et_key;
  if (metric == "ER_deg") return object_ER_key;
  if (metric == "Ev_kmh") return velocity_key;
  return metric == "v_gt_kmh" ? velocity_truth_key : metric;
}

bool MetricPreset::aggregates(const std::string& metric) const {
  return metric == "Et_m" || metric == "ER_deg" || metric == "Ev_kmh";
}

double aggregate(Aggregate how, std::span<const double> values) {
  SEXTANT_CHECK(!values.empty());
  const bool squares = how == Aggregate::rmse;
  double sum = 0;
  for (const double v : values) sum += squares ? v * v : v;
  const double mean = sum / static_cast<double>(values.size());
  return squares ? std::sqrt(mean) : mean;
}

std::span<const MetricPreset> metric_presets() { return table(); }

const MetricPreset& find_preset(std::string_view name) {
  return find_entry(metric_presets(), name, "metric preset");
}

}  // namespace sextant
