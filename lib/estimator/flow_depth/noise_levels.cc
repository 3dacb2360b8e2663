#include "sextant/estimator/flow_depth/noise_levels.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include "sextant/base/quantile.h"
#include "sextant/estimator/flow_depth/correlated_errors.h"
#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

// Measurements are quantised; no smaller standard deviation is meaningful (px).
constexpr double min_sigma_px = 0.01;
constexpr size_t level_sample = 1000;  // up to twice as many values determine a scale to 3 or 4 %
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

namespace {

constexpr size_t min_neighbours = 9;  // three unknowns, and six degrees of freedom for the test
constexpr double max_pixel = 1e5;     // no valid image coordinate is larger
constexpr double max_columns = 1000;

struct Point {
  double one = 1;
  double u, v;     // px
  double inverse;  // 1/m
};
static_assert(sizeof(Point) == sizeof(Lanes));
using Rows = std::array<std::span<const Point>, 3>;

/// Computes the sum of p p^T over all points, row by row, with p = [1 u v s] - [0 u v s] of `about`.
SEXTANT_SIMD void sum_moments(const Rows& rows, const Point& about, double* moments) {
  const Lanes centre = {0, about.u, about.v, about.inverse};
  Lanes m0 = {}, m1 = {}, m2 = {}, m3 = {};
  for (const std::span<const Point>& row : rows) {
    for (const Point& point : row) {
      const Lanes p = SEXTANT_LOAD(&point.one) - centre;
      m0 += p;
      m1 += p * p[1];
      m2 += p * p[2];
      m3 += p * p[3];
    }
  }
  SEXTANT_STORE(moments, m0);
  SEXTANT_STORE(moments + 4, m1);
  SEXTANT_STORE(moments + 8, m2);
  SEXTANT_STORE(moments + 12, m3);
}

/// Points grouped by cell of side >= `side` px, cells row by row.
class CellGrid {
 public:
  CellGrid(const std::vector<Point>& points, double side) {
    const PixelExtent extent(points);
    // Coarser cells for few points that are far apart.
    const double per_side = 1 / std::max({side, extent.width() / max_columns, extent.height() / max_columns});
    columns_ = static_cast<size_t>(extent.width() * per_side) + 1;
    rows_ = static_cast<size_t>(extent.height() * per_side) + 1;
    begin_.assign(columns_ * rows_ + 2, 0);
    std::vector<uint32_t> cells(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      const auto row = static_cast<size_t>((points[i].v - extent.min_v) * per_side);
      const auto column = static_cast<size_t>((points[i].u - extent.min_u) * per_side);
      cells[i] = static_cast<uint32_t>(row * columns_ + column);
      ++begin_[cells[i] + 2];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    members_.resize(points.size());
    order_.resize(points.size());
    cells_.resize(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      const uint32_t to = begin_[cells[i] + 1]++;  // becomes the beginning of the next cell
      members_[to] = points[i];
      order_[to] = static_cast<uint32_t>(i);
      cells_[to] = cells[i];
    }
  }

  size_t size() const { return members_.size(); }
  /// Index of member k in the given list of points.
  size_t index(size_t k) const { return order_[k]; }
  const Point& member(size_t k) const { return members_[k]; }
  /// Returns the end of the range of members in member k's cell.
  size_t end_of_cell(size_t k) const { return begin_[cells_[k] + 1]; }
  /// Returns the points of the nine cells around member k.
  Rows around(size_t k) const {
    const size_t row = cells_[k] / columns_;
    const size_t column = cells_[k] % columns_;
    Rows rows;
    for (size_t y = row > 0 ? row - 1 : 0; y <= std::min(row + 1, rows_ - 1); ++y) {
      const size_t first = y * columns_ + (column > 0 ? column - 1 : 0);
      const size_t last = y * columns_ + std::min(column + 1, columns_ - 1);
      rows[y + 1 - row] = {members_.data() + begin_[first], begin_[last + 1] - begin_[first]};
    }
    return rows;
  }

 private:
  size_t columns_ = 0, rows_ = 0;
  std::vector<uint32_t> begin_;  ///< first member, by cell
  std::vector<Point> members_;
  std::vector<uint32_t> order_, cells_;
};

LocalPlane fit_plane(const Eigen::Matrix4d& moments, double kappa) {
  const double n = moments(0, 0);
  const Eigen::Vector3d sum = moments.col(0).tail<3>();
  const Eigen::Matrix3d c = moments.bottomRightCorner<3, 3>() - sum * sum.transpose() / n;
  const double determinant = c(0, 0) * c(1, 1) - c(0, 1) * c(0, 1);
  if (!(determinant > 1e-3 * c(0, 0) * c(1, 1))) return {};
  const double slope_u = (c(0, 2) * c(1, 1) - c(1, 2) * c(0, 1)) / determinant;
  const double slope_v = (c(1, 2) * c(0, 0) - c(0, 2) * c(0, 1)) / determinant;
  const double dof = n - 3;
  const double residual = (c(2, 2) - slope_u * c(0, 2) - slope_v * c(1, 2)) / (kappa * kappa);
  const bool agrees = residual <= dof + 2.33 * std::sqrt(2 * dof);
  return {true, slope_u, slope_v, agrees ? 0 : (residual / dof - 1) * kappa * kappa};
}

}  // namespace

std::vector<LocalPlane> fit_local_planes(const Correspondences& points, double kappa, double radius_px) {
  std::vector<LocalPlane> planes(points.size());
  std::vector<Point> valid;
  std::vector<uint32_t> index;
  valid.reserve(points.size());
  index.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (points.depth[i] > 0 && std::isfinite(points.depth[i]) && std::abs(points.u[i]) < max_pixel &&
        std::abs(points.v[i]) < max_pixel) {
      valid.push_back({1, points.u[i], points.v[i], 1 / points.depth[i]});
      index.push_back(static_cast<uint32_t>(i));
    }
  }
  if (valid.size() < min_neighbours || !(kappa > 0)) return planes;
  const CellGrid grid(valid, 2 * radius_px / 3);
  for (size_t k = 0; k < grid.size();) {
    const size_t end = grid.end_of_cell(k);
    const Rows rows = grid.around(k);
    if (rows[0].size() + rows[1].size() + rows[2].size() < min_neighbours) {
      k = end;
      continue;
    }
    Eigen::Matrix4d moments;
    sum_moments(rows, grid.member(k), moments.data());
    const LocalPlane plane = fit_plane(moments, kappa);
    for (; k < end; ++k) planes[index[grid.index(k)]] = plane;
  }
  return planes;
}

}  // namespace sextant
