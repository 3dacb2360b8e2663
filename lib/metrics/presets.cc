#include "sextant/metrics/presets.h"

#include <algorithm>
#include <array>
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

std::string_view to_string(Aggregate aggregate) {
  constexpr std::array<std::string_view, 4> names = {"mean", "RMSE", "median", "max"};
  return names.at(static_cast<size_t>(aggregate));
}

double aggregate(Aggregate how, std::span<const double> values) {
  SEXTANT_CHECK(!values.empty());
  const auto n = static_cast<double>(values.size());
  double sum = 0;
  switch (how) {
    case Aggregate::mean:
      for (const double v : values) sum += v;
      return sum / n;
    case Aggregate::rmse:
      for (const double v : values) sum += v * v;
      return std::sqrt(sum / n);
    case Aggregate::median: {
      std::vector<double> sorted(values.begin(), values.end());
      std::sort(sorted.begin(), sorted.end());
      const size_t half = sorted.size() / 2;
      return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
    }
    case Aggregate::max:
      return *std::max_element(values.begin(), values.end());
  }
  SEXTANT_CHECK(false);
}

std::span<const MetricPreset> metric_presets() { return table(); }

const MetricPreset& find_preset(std::string_view name) {
  return find_entry(metric_presets(), name, "metric preset");
}

}  // namespace sextant
