#include "sextant/estimator/flow_depth/noise_levels.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "sextant/base/quantile.h"
#include "sextant/estimator/flow_depth/correlated_errors.h"
#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

// Smallest standard deviations. Pixel coordinates in single precision have a resolution of 0.0001 to 0.0002
// px. The floor of the flow matters where flow is exact and depth is not: flow errors that are assumed larger
// than they are make the relief of a distant body look insignificant.
constexpr double min_sigma_flow_px = 0.0003;
constexpr double min_delta_d_px = 0.01;  // disparities in files are quantised
constexpr size_t level_sample = 1000;    // up to twice as many values determine a scale to 3 or 4 %
constexpr double max_delta_d_px = 5.0;
constexpr double normal_mad = 1.4826;
// Median of |n| for a standard normal n with |n| < 3.
constexpr double median_within_three = 0.6728;

/// Sorts numbers >= 0 in ascending order by their bit patterns, which have the same order. Radix sort with
/// three digits of 11 bits: no comparisons, whose branches random numbers would mispredict.
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

/// Returns the residuals of the included points at the motion of the last evaluation. `value(i, out)` appends
/// those of point i.
template <typename Value>
std::vector<float> collect(const RoughFlowDepthData& data, Value&& value) {
  std::vector<float> out;
  out.reserve(2 * data.size());
  for (size_t i = 0; i < data.size(); ++i) {
    if (data.used(i) && std::isfinite(data.q(i))) value(i, out);
  }
  return out;
}

/// Returns the residual across or along the epipolar direction (px) of each point that has one.
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

/// Returns the derivative of the residual along the epipolar direction with respect to delta_d.
std::vector<float> slopes(const RoughFlowDepthData& data) {
  return collect(data, [&](size_t i, std::vector<float>& out) {
    const double slope_u = data.slope_u(i), slope_v = data.slope_v(i);
    const double length = std::sqrt(slope_u * slope_u + slope_v * slope_v);
    if (length > 0) out.push_back(static_cast<float>(length / data.camera().bf));
  });
}

/// Returns the differences of measured and predicted current disparities, px.
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

/// Returns the initial values of robust_scale: `errors` of the start's inliers; empty if these are the points
/// whose scale is estimated.
template <typename Errors>
std::vector<float> likely(const LevelSample& sample, LevelsOf which, Errors&& errors) {
  return which == LevelsOf::all ? errors(sample.inliers) : std::vector<float>();
}

/// Evaluates with depths fixed at the measured ones. Returns the requested points.
const RoughFlowDepthData& evaluate_measured(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev) {
  evaluate_points(sample.inliers, T_curr_prev, {});
  if (which == LevelsOf::inliers) return sample.inliers;
  evaluate_points(sample.all, T_curr_prev, {});
  return sample.all;
}

/// Returns the delta_d for which the residual along the epipolar direction has the expected variance.
double delta_d_along(const std::vector<float>& along, const std::vector<float>& slope, double sigma) {
  double low = 0;
  double high = max_delta_d_px;
  const double threshold2 = 1 / (normal_mad * normal_mad);
  for (int step = 0; step < 20; ++step) {
    const double delta = 0.5 * (low + high);
    // The median of the normalised residuals exceeds the threshold if at most half of them are within.
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
  double scale = normal_mad * upper_median(likely);
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
    const double sigma = std::max(robust_scale(across, likely(sample, which, across_of)), min_sigma_flow_px);
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
    levels.delta_d_px = std::max(delta, min_delta_d_px);
  }
  return levels;
}

NoiseLevels estimate_reprojection_level(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev) {
  const std::vector<float> errors = reprojection_errors(evaluate_measured(sample, which, T_curr_prev));
  const double scale = robust_scale(errors, likely(sample, which, reprojection_errors));
  const double sigma = std::max(scale, min_sigma_flow_px);
  return {.sigma_flow_u_px = sigma, .sigma_flow_v_px = sigma};
}

double estimate_delta_d_curr(LevelSample& sample, const SE3& T_curr_prev, const NoiseLevels& levels) {
  constexpr LevelsOf which = LevelsOf::all;
  const std::vector<float> errors = disparity_errors(evaluate_measured(sample, which, T_curr_prev));
  const double total = robust_scale(errors, likely(sample, which, disparity_errors));
  const double rest = total * total - levels.delta_d_px * levels.delta_d_px;
  return std::sqrt(std::max(rest, levels.delta_d_px * levels.delta_d_px));
}

namespace {

constexpr double min_neighbours = 9;  // three unknowns, and six degrees of freedom for the test
constexpr double max_pixel = 1e5;     // no valid image coordinate is larger
constexpr double max_columns = 1000;

/// Sums over points p = [1 u v s], u and v in px, inverse depth s in 1/m: of p; of the squares of u, v and s;
/// of uv, vs and su (elements 1 to 3).
struct Moments {
  LaneTypes<double>::Unaligned values, squares, products;

  SEXTANT_INLINED void add(const Lanes& p) {
    values += p;
    squares += p * p;
    products += p * Lanes{p[0], p[2], p[3], p[1]};
  }
  SEXTANT_INLINED Moments& operator+=(const Moments& other) {
    values += other.values, squares += other.squares, products += other.products;
    return *this;
  }
  SEXTANT_INLINED Moments& operator-=(const Moments& other) {
    values -= other.values, squares -= other.squares, products -= other.products;
    return *this;
  }
};

/// `side_px`: of a cell. Points whose spread along an axis is below a hundredth of it lie on a line.
SEXTANT_INLINED LocalPlane fit_plane(const Moments& sum, double kappa, double side_px) {
  const double n = sum.values[0], per_n = 1 / n;
  const Lanes variances = sum.squares - per_n * sum.values * sum.values;
  const double u = sum.values[1], v = sum.values[2], s = sum.values[3];
  const double uu = variances[1], vv = variances[2], ss = variances[3];
  const double uv = sum.products[1] - per_n * u * v;
  const double vs = sum.products[2] - per_n * v * s;
  const double us = sum.products[3] - per_n * s * u;
  const double determinant = uu * vv - uv * uv;
  const double least = 1e-4 * n * side_px * side_px;
  if (!(determinant > 1e-3 * uu * vv) || !(std::min(uu, vv) > least)) return {};
  const double per_determinant = 1 / determinant;
  const double slope_u = (us * vv - vs * uv) * per_determinant;
  const double slope_v = (vs * uu - us * uv) * per_determinant;
  const double dof = n - 3;
  const double residual = (ss - slope_u * us - slope_v * vs) / (kappa * kappa);
  const bool agrees = residual <= dof + 2.33 * std::sqrt(2 * dof);
  return {true, slope_u, slope_v, agrees ? 0 : (residual / dof - 1) * kappa * kappa};
}

/// Cells of a grid; those with points are numbered from 1, row by row.
struct PlaneGrid {
  double side_px;
  size_t columns, rows;
  std::vector<uint32_t> before;  ///< before[c]: how many of the first c cells have points
  std::vector<uint32_t> cell;    ///< cell of each number
};

/// Computes the sums over all points of the numbers 1 to k in sums[k]. `numbers`: by point, 0 = left out.
SEXTANT_SIMD void sum_up(const Correspondences& points, const PixelExtent& extent,
                         const std::vector<uint32_t>& numbers, Moments* sums, size_t n) {
  std::fill_n(sums, n, Moments{});
  for (size_t i = 0; i < points.size(); ++i) {
    sums[numbers[i]].add(
        Lanes{1, points.u[i] - extent.min_u, points.v[i] - extent.min_v, 1 / points.depth[i]});
  }
  sums[0] = Moments{};
  for (size_t k = 1; k < n; ++k) sums[k] += sums[k - 1];
}

/// Fits a plane to the points of the nine cells around each cell with points.
SEXTANT_SIMD void fit_planes(const PlaneGrid& cells, const Moments* sums, double kappa,
                             std::vector<LocalPlane>& planes) {
  for (size_t k = 1; k < planes.size(); ++k) {
    const size_t row = cells.cell[k] / cells.columns, column = cells.cell[k] % cells.columns;
    const size_t first = column > 0 ? column - 1 : 0, last = std::min(column + 1, cells.columns - 1);
    Moments around{};
    for (size_t y = row > 0 ? row - 1 : 0; y <= std::min(row + 1, cells.rows - 1); ++y) {
      around += sums[cells.before[y * cells.columns + last + 1]];
      around -= sums[cells.before[y * cells.columns + first]];
    }
    if (around.values[0] >= min_neighbours) planes[k] = fit_plane(around, kappa, cells.side_px);
  }
}

}  // namespace

LocalPlanes::LocalPlanes(const Correspondences& points, double kappa, double radius_px)
    : of_point_(points.size(), 0), planes_(1) {
  const auto counts = [&](size_t i) {
    return points.depth[i] >= min_depth_m && std::isfinite(points.depth[i]) &&
           std::abs(points.u[i]) < max_pixel && std::abs(points.v[i]) < max_pixel;
  };
  PixelExtent extent;
  for (size_t i = 0; i < points.size(); ++i) {
    if (counts(i)) extent.add(points.u[i], points.v[i]);
  }
  if (!extent.is_of_an_image() || !(kappa > 0)) return;
  // Coarser cells for few points that are far apart.
  const double side =
      std::max({2 * radius_px / 3, extent.width() / max_columns, extent.height() / max_columns});
  const auto index = [&](double px) { return static_cast<size_t>(px / side); };
  PlaneGrid cells{side, index(extent.width()) + 1, index(extent.height()) + 1, {}, {}};
  cells.before.resize(cells.columns * cells.rows + 1);
  for (size_t i = 0; i < points.size(); ++i) {
    if (!counts(i)) continue;
    const size_t cell = index(points.v[i] - extent.min_v) * cells.columns + index(points.u[i] - extent.min_u);
    of_point_[i] = static_cast<uint32_t>(cell + 1);
    cells.before[cell + 1] = 1;
  }
  std::partial_sum(cells.before.begin(), cells.before.end(), cells.before.begin());
  planes_.resize(cells.before.back() + 1);
  cells.cell.resize(planes_.size());
  for (uint32_t& number : of_point_) {
    if (number == 0) continue;
    const uint32_t cell = number - 1;
    number = cells.before[number];
    cells.cell[number] = cell;
  }
  ReusedArray<double> memory(planes_.size() * sizeof(Moments) / sizeof(double));
  auto* const sums = reinterpret_cast<Moments*>(memory.get());
  sum_up(points, extent, of_point_, sums, planes_.size());
  fit_planes(cells, sums, kappa, planes_);
}

}  // namespace sextant
