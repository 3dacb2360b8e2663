#include "sextant/estimator/solvers/noise_levels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "sextant/base/quantile.h"

namespace sextant {
namespace {

// Measurements are stored in steps; nothing is known better than this (px).
constexpr double min_sigma_px = 0.01;
constexpr size_t level_sample = 1000;  // to twice as many tell a scale to 3 or 4 %
constexpr double max_delta_d_px = 5.0;
constexpr double normal_mad = 1.4826;
// Median of |n| for a normal n with |n| < 3.
constexpr double median_within_three = 0.6728;

/// Ascending, of numbers >= 0: their bit patterns have the same order. Digit by digit, three of 11 bits: no
/// comparisons, which in random numbers cannot be predicted.
void sort_non_negative(std::vector<float>& values) {
  constexpr int digit_bits = 11;
  constexpr uint32_t n_digits = 1U << digit_bits;
  std::vector<float> sorted(values.size());
  for (int shift = 0; shift < 32; shift += digit_bits) {
    const auto digit = [&](float value) { return std::bit_cast<uint32_t>(value) >> shift & (n_digits - 1); };
    std::array<uint32_t, n_digits + 1> begin{};
    for (const float value : values) ++begin[digit(value) + 1];
    for (uint32_t k = 0; k < n_digits; ++k) begin[k + 1] += begin[k];
    for (const float value : values) sorted[begin[digit(value)]++] = value;
    std::swap(values, sorted);
  }
}

/// Residuals of the points in use at the motion of the last evaluation.
/// `value(i, out)` appends those of point i.
template <typename Value>
std::vector<float> collect(const RoughFlowDepthData& data, Value&& value) {
  std::vector<float> out;
  out.reserve(2 * data.size());
  for (size_t i = 0; i < data.size(); ++i) {
    if (data.used(i) && std::isfinite(data.q(i))) value(i, out);
  }
  return out;
}

/// Across the epipolar direction or along it, px; per point that has one.
std::vector<float> epipolar(const RoughFlowDepthData& data, bool along) {
  return collect(data, [&](size_t i, std::vector<float>& out) {
    const double error_u = data.error_u(i), slope_u = data.slope_u(i);
    const double error_v = data.error_v(i), slope_v = data.slope_v(i);
    const double length = std::sqrt(slope_u * slope_u + slope_v * slope_v);
    if (!(length > 0)) return;
    const double error =
        along ? error_u * slope_u + error_v * slope_v : error_u * slope_v - error_v * slope_u;
    out.push_back(static_cast<float>(std::abs(error) / length));
  });
}

/// How the residual along the epipolar direction changes with delta_d.
std::vector<float> slopes(const RoughFlowDepthData& data) {
  return collect(data, [&](size_t i, std::vector<float>& out) {
    const double slope_u = data.slope_u(i), slope_v = data.slope_v(i);
    const double length = std::sqrt(slope_u * slope_u + slope_v * slope_v);
    if (length > 0) out.push_back(static_cast<float>(length / data.camera().bf));
  });
}

/// Of the current disparity against the prediction, px.
std::vector<float> disparity_errors(const RoughFlowDepthData& data) {
  return collect(data, [&](size_t i, std::vector<float>& out) {
    if (!data.measures_depth_curr(i)) return;
    const double error = data.inverse_depth_curr_measured(i) - data.inverse_depth_curr(i);
    out.push_back(static_cast<float>(std::abs(data.camera().bf * error)));
  });
}

std::vector<float> reprojection_errors(const RoughFlowDepthData& data) {
  return collect(data, [&](size_t i, std::vector<float>& out) {
    out.push_back(std::abs(data.error_u(i)));
    out.push_back(std::abs(data.error_v(i)));
  });
}

/// What robust_scale begins with: `errors` of the start's inliers, nothing if they are all there is.
template <typename Errors>
std::vector<float> likely(const LevelSample& sample, LevelsOf which, Errors&& errors) {
  return which == LevelsOf::all ? errors(sample.inliers) : std::vector<float>();
}

/// Depths fixed at what was measured. Returns the points asked for.
const RoughFlowDepthData& evaluate_measured(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev) {
  evaluate_points(sample.inliers, T_curr_prev, {});
  if (which == LevelsOf::inliers) return sample.inliers;
  evaluate_points(sample.all, T_curr_prev, {});
  return sample.all;
}

/// delta_d such that the residual along the epipolar direction has the variance expected.
double delta_d_along(const std::vector<float>& along, const std::vector<float>& slope, double sigma) {
  double low = 0;
  double high = max_delta_d_px;
  const double threshold2 = 1 / (normal_mad * normal_mad);
  for (int step = 0; step < 20; ++step) {
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

LevelSample::LevelSample(const RoughFlowDepthData& data, const StartingPoint& start)
    : all(data.sample(level_sample)), inliers(data.sample(level_sample, start.inliers)) {
  if (inliers.size() == 0) inliers = data.sample(level_sample);
}

double robust_scale(std::vector<float> absolute, std::vector<float> likely) {
  if (absolute.empty()) return 0;
  if (likely.empty()) likely = absolute;
  double scale = normal_mad * middle_of(likely);
  sort_non_negative(absolute);
  for (int step = 0; step < 20; ++step) {
    const auto end = std::upper_bound(absolute.begin(), absolute.end(), 3 * scale);
    const auto n = static_cast<size_t>(end - absolute.begin());
    if (n == 0) break;
    const double next = absolute[n / 2] / median_within_three;
    const bool settled = std::abs(next - scale) <= 1e-3 * scale;
    scale = next;
    if (settled) break;
  }
  return scale;
}

NoiseLevels estimate_noise_levels(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev,
                                  const NoiseLevels& declared) {
  NoiseLevels levels = declared;
  const bool flow_known = levels.sigma_flow_u_px > 0 && levels.sigma_flow_v_px > 0;
  if (flow_known && levels.delta_d_px > 0) return levels;
  const RoughFlowDepthData& points = evaluate_measured(sample, which, T_curr_prev);
  const auto across_of = [](const RoughFlowDepthData& data) { return epipolar(data, false); };
  const std::vector<float> across = across_of(points);
  if (!flow_known) {
    const double sigma = std::max(robust_scale(across, likely(sample, which, across_of)), min_sigma_px);
    if (!(levels.sigma_flow_u_px > 0)) levels.sigma_flow_u_px = sigma;
    if (!(levels.sigma_flow_v_px > 0)) levels.sigma_flow_v_px = sigma;
  }
  if (!(levels.delta_d_px > 0)) {
    const double sigma = std::sqrt(0.5 * (levels.sigma_flow_u_px * levels.sigma_flow_u_px +
                                          levels.sigma_flow_v_px * levels.sigma_flow_v_px));
    const std::vector<float> disparities = disparity_errors(points);
    double delta = 0;
    if (2 * disparities.size() > across.size()) {
      delta = robust_scale(disparities, likely(sample, which, disparity_errors)) / std::sqrt(2.0);
    } else if (!across.empty()) {
      delta = delta_d_along(epipolar(points, true), slopes(points), sigma);
    }
    levels.delta_d_px = std::max(delta, min_sigma_px);
  }
  return levels;
}

NoiseLevels estimate_reprojection_level(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev) {
  const std::vector<float> errors = reprojection_errors(evaluate_measured(sample, which, T_curr_prev));
  const double scale = robust_scale(errors, likely(sample, which, reprojection_errors));
  const double sigma = std::max(scale, min_sigma_px);
  return {.sigma_flow_u_px = sigma, .sigma_flow_v_px = sigma};
}

double estimate_delta_d_curr(LevelSample& sample, const SE3& T_curr_prev, const NoiseLevels& levels) {
  constexpr LevelsOf which = LevelsOf::all;
  const std::vector<float> errors = disparity_errors(evaluate_measured(sample, which, T_curr_prev));
  const double total = robust_scale(errors, likely(sample, which, disparity_errors));
  const double rest = total * total - levels.delta_d_px * levels.delta_d_px;
  return std::sqrt(std::max(rest, levels.delta_d_px * levels.delta_d_px));
}

}  // namespace sextant
