#pragma once

// Measurements of one rigid body as a structure of arrays for flow_depth_solver.h, and their noise levels.
// Double precision for the final estimate; single precision, with twice as many points at a time, for
// intermediate steps: starting motions, noise levels and the choice of points. Units: px, m, 1/m.

#include <algorithm>
#include <memory>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/geometry/lanes.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Quantity that is measured with Gaussian errors.
enum class DepthErrors { depth, disparity };
constexpr Names<2> names_of(DepthErrors) { return {"depth", "disparity"}; }

/// Standard deviations of the measurements of one body.
struct NoiseLevels {
  double sigma_flow_u_px = 1;
  double sigma_flow_v_px = 1;
  double delta_d_px = 0;       ///< 0 = the depth is exact
  double delta_d_curr_px = 0;  ///< accuracy of the current depth, if measured; 0 = do not use it
  DepthErrors depth_noise = DepthErrors::depth;
  /// true: q and gradient are computed to first order about the measured depths, which are not refined
  bool as_measured = false;
};

/// The depth measurements of one point and the square roots of their information (m); 0 = not measured.
struct PointDepths {
  double inverse_depth = 0;  ///< 1/m
  double weight = 0;
  double inverse_depth_curr = 1;
  double weight_curr = 0;
};

/// Uninitialised array whose memory serves later arrays of the same thread. The memory of arrays of some
/// hundred kilobytes would otherwise be returned to the system, which clears its pages for every use.
template <typename Real>
class ReusedArray {
 public:
  explicit ReusedArray(size_t size);
  ~ReusedArray();
  ReusedArray(ReusedArray&& other) noexcept = default;
  ReusedArray& operator=(ReusedArray&& other) noexcept;
  Real* get() { return values_.get(); }
  const Real* get() const { return values_.get(); }

 private:
  size_t capacity_ = 0;
  std::unique_ptr<Real[]> values_;
};

template <typename Real>
class FlowDepthPoints {
 public:
  /// Copies all points of the problem; invalid ones (NaN, depth <= 0) are always excluded.
  explicit FlowDepthPoints(const Problem& problem);
  /// Copies the points of another precision.
  template <typename Other>
  explicit FlowDepthPoints(const FlowDepthPoints<Other>& other);

  size_t size() const { return size_; }
  const StereoCamera& camera() const { return camera_; }
  /// Includes or excludes point i, and its current depth.
  void use(size_t i, bool point, bool depth_curr) {
    column(weight)[i] = static_cast<Real>(point & (valid_[i] != 0));
    column(has_curr)[i] = depth_curr ? share_curr_[i] : Real(0);
  }
  bool used(size_t i) const { return column(weight)[i] > 0; }
  bool uses_depth_curr(size_t i) const { return column(has_curr)[i] > 0; }
  bool measures_depth_curr(size_t i) const { return share_curr_[i] > 0; }
  bool is_measurement(size_t i) const { return valid_[i] != 0; }
  size_t n_used() const;
  /// Returns every k-th of the included points with among[i] != 0 (`among` empty: of all): `size` to 2 `size`
  /// points, or all if there are fewer.
  FlowDepthPoints sample(size_t size, const std::vector<unsigned char>& among = {}) const;
  /// Multiplies the information of the current depth of point i by `share` when use() includes it next; 0:
  /// the depth is not used.
  void weaken_depth_curr(size_t i, double share) { share_curr_[i] *= static_cast<Real>(share); }
  void shift_inverse_depth_curr(size_t i, double change) {
    column(measured_curr)[i] += static_cast<Real>(change);
  }
  /// Resets the depths to the measured ones, from which the next evaluation starts.
  void reset_depths();
  /// Continues with the refined depths of the same points in another object.
  template <typename Other>
  void take_depths(const FlowDepthPoints<Other>& other) {
    std::copy_n(other.column(FlowDepthPoints<Other>::refined), size_, column(refined));
  }

  /// Returns the depth information of point i at these noise levels.
  PointDepths depths(size_t i, const NoiseLevels& levels) const;

  /// Results of the last evaluate_points(), at the minimum over the depth. q: +inf behind the camera or
  /// without a measurement; error: u' - u - flow_u, px; slope: d u' / d s, px m; inverse depths: 1/m, refined
  /// and predicted; x_curr: (u' - cx) / fx.
  Real q(size_t i) const { return column(squared_distance)[i]; }
  Real error_u(size_t i) const { return column(residual_u)[i]; }
  Real error_v(size_t i) const { return column(residual_v)[i]; }
  Real slope_u(size_t i) const { return column(du_ds)[i]; }
  Real slope_v(size_t i) const { return column(dv_ds)[i]; }
  Real inverse_depth(size_t i) const { return column(refined)[i]; }
  Real inverse_depth_curr(size_t i) const { return column(predicted_curr)[i]; }
  Real x_curr(size_t i) const { return column(moved_x)[i]; }
  Real y_curr(size_t i) const { return column(moved_y)[i]; }
  /// Returns the measured inverse depth in the current frame, 1/m.
  Real inverse_depth_curr_measured(size_t i) const { return column(measured_curr)[i]; }

  /// Arrays for the loops, each with `padded` numbers, a multiple of the lane size; padding is always
  /// excluded.
  // clang-format off
  enum Column {
    x, y, target_u, target_v, measured, measured_curr, weight, has_curr,
    refined, squared_distance, residual_u, residual_v, du_ds, dv_ds, predicted_curr, moved_x, moved_y,
    n_columns
  };
  // clang-format on
  size_t padded() const { return padded_; }
  Real* column(Column k) { return values_.get() + k * padded_; }
  const Real* column(Column k) const { return values_.get() + k * padded_; }

 private:
  template <typename Other>
  friend class FlowDepthPoints;
  FlowDepthPoints(const StereoCamera& camera, size_t size);
  /// Replaces invalid measurements by valid numbers that are always excluded.
  void neutralise_invalid();
  StereoCamera camera_;
  size_t size_ = 0;
  size_t padded_ = 0;
  std::vector<unsigned char> valid_;
  std::vector<Real> share_curr_;
  ReusedArray<Real> values_;
};

using FlowDepthData = FlowDepthPoints<double>;
using RoughFlowDepthData = FlowDepthPoints<float>;

}  // namespace sextant
