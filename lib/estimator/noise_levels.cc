#include "sextant/estimator/noise_levels.h"

#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

// Measurements are stored in steps; nothing is known better than this (px).
constexpr double min_sigma_px = 0.01;
constexpr double max_delta_d_px = 5.0;
constexpr double normal_mad = 1.4826;
// Median of |n| for a normal n with |n| < 3.
constexpr double median_within_three = 0.6728;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// A scale from so many points is known to 3 %.
constexpr size_t sample_size = 1500;
size_t stride_of(const FlowDepthData& data) { return std::max<size_t>(data.size() / sample_size, 1); }

/// The depths fixed at what was measured.
PointEvaluation evaluate_measured(FlowDepthData& data, const SE3& T_curr_prev) {
  PointEvaluation at;
  evaluate_points(data, T_curr_prev, {}, at);
  return at;
}

/// delta_d such that the residual along the epipolar direction has the variance expected.
double delta_d_along(const std::vector<double>& along, const std::vector<double>& slope, double sigma) {
  double low = 0;
  double high = max_delta_d_px;
  const double threshold2 = 1 / (normal_mad * normal_mad);
  for (int step = 0; step < 30; ++step) {
    const double delta = 0.5 * (low + high);
    // The median of the normalised residuals is above the threshold if no more than half of them are within.
    size_t within = 0;
    for (size_t i = 0; i < along.size(); ++i) {
      const double variance = sigma * sigma + slope[i] * slope[i] * delta * delta;
      within += along[i] * along[i] <= threshold2 * variance ? 1 : 0;
    }
    (within <= along.size() / 2 ? low : high) = delta;
  }
  return high;
}

}  // namespace

double robust_scale(std::vector<double> absolute) {
  if (absolute.empty()) return 0;
  double scale = normal_mad * median(absolute);
  std::vector<double> within;
  for (int step = 0; step < 20; ++step) {
    within.clear();
    for (const double a : absolute) {
      if (a <= 3 * scale) within.push_back(a);
    }
    if (within.empty()) break;
    const double next = median(within) / median_within_three;
    const bool settled = std::abs(next - scale) <= 1e-3 * scale;
    scale = next;
    if (settled) break;
  }
  return scale;
}

NoiseLevels estimate_noise_levels(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& declared) {
  NoiseLevels levels = declared;
  const bool flow_known = levels.sigma_flow_u_px > 0 && levels.sigma_flow_v_px > 0;
  if (flow_known && levels.delta_d_px > 0) return levels;
  const PointEvaluation at = evaluate_measured(data, T_curr_prev);
  const double bf = data.camera().bf;
  std::vector<double> across, along, slope, disparity;
  for (size_t i = 0; i < data.size(); i += stride_of(data)) {
    if (!data.used(i) || !std::isfinite(at.q[i])) continue;
    const double length = std::sqrt(at.slope_u[i] * at.slope_u[i] + at.slope_v[i] * at.slope_v[i]);
    if (!(length > 0)) continue;
    across.push_back(std::abs(at.error_u[i] * at.slope_v[i] - at.error_v[i] * at.slope_u[i]) / length);
    along.push_back((at.error_u[i] * at.slope_u[i] + at.error_v[i] * at.slope_v[i]) / length);
    slope.push_back(length / bf);
    if (data.measures_depth_curr(i)) {
      disparity.push_back(std::abs(bf * (data.inverse_depth_curr(i) - at.inverse_depth_curr[i])));
    }
  }
  if (!flow_known) {
    const double sigma = std::max(robust_scale(across), min_sigma_px);
    if (!(levels.sigma_flow_u_px > 0)) levels.sigma_flow_u_px = sigma;
    if (!(levels.sigma_flow_v_px > 0)) levels.sigma_flow_v_px = sigma;
  }
  if (!(levels.delta_d_px > 0)) {
    const double sigma = std::sqrt(0.5 * (levels.sigma_flow_u_px * levels.sigma_flow_u_px +
                                          levels.sigma_flow_v_px * levels.sigma_flow_v_px));
    const double delta = 2 * disparity.size() > across.size() ? robust_scale(disparity) / std::sqrt(2.0)
                         : along.empty()                      ? 0
                                                              : delta_d_along(along, slope, sigma);
    levels.delta_d_px = std::max(delta, min_sigma_px);
  }
  return levels;
}

NoiseLevels estimate_reprojection_level(FlowDepthData& data, const SE3& T_curr_prev) {
  const PointEvaluation at = evaluate_measured(data, T_curr_prev);
  std::vector<double> errors;
  for (size_t i = 0; i < data.size(); i += stride_of(data)) {
    if (!data.used(i) || !std::isfinite(at.q[i])) continue;
    errors.push_back(std::abs(at.error_u[i]));
    errors.push_back(std::abs(at.error_v[i]));
  }
  const double sigma = std::max(robust_scale(std::move(errors)), min_sigma_px);
  return {.sigma_flow_u_px = sigma, .sigma_flow_v_px = sigma};
}

double estimate_delta_d_curr(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels) {
  const PointEvaluation at = evaluate_measured(data, T_curr_prev);
  std::vector<double> disparity;
  for (size_t i = 0; i < data.size(); i += stride_of(data)) {
    if (!data.used(i) || !std::isfinite(at.q[i]) || !data.measures_depth_curr(i)) continue;
    disparity.push_back(std::abs(data.camera().bf * (data.inverse_depth_curr(i) - at.inverse_depth_curr[i])));
  }
  const double total = robust_scale(disparity);
  const double rest = total * total - levels.delta_d_px * levels.delta_d_px;
  return std::sqrt(std::max(rest, levels.delta_d_px * levels.delta_d_px));
}

}  // namespace sextant
