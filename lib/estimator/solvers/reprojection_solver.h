#pragma once

// Minimises the robust reprojection cost of one rigid body over its motion X = T_curr_prev (paper eq. (4),
// (10)):
//
//   C(X) = 1/2 sum_i h(p_i + phi_i - project(X m_i)),  m_i = backproject(p_i, d_i),  h: robust_kernel.h
//
// The cost is infinite if a point is not in front of the camera. Units: px, m, rad.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/estimator/solvers/robust_kernel.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Points and target pixels as a padded structure of arrays for vectorised loops. Double precision for
/// estimates; single precision, with twice as many points at a time, for intermediate steps.
template <typename Real>
class ReprojectionPoints {
 public:
  /// Selects the points of the problem with these indices, in this order.
  ReprojectionPoints(const Problem& problem, std::span<const uint32_t> indices);
  /// Selects the points with keep[i] != 0; `keep` has one entry per point of the problem.
  ReprojectionPoints(const Problem& problem, const std::vector<unsigned char>& keep);
  explicit ReprojectionPoints(const Problem& problem)
      : ReprojectionPoints(problem, std::vector<unsigned char>(problem.points.size(), 1)) {}

  size_t size() const { return size_; }
  const PinholeCamera& camera() const { return camera_; }
  /// Includes point i in the sums (`point` is true) or excludes it; initially all points are included.
  void use(size_t i, bool point) { column(weight)[i] = static_cast<Real>(point); }

  /// Arrays of `padded_size` numbers, a multiple of the lane size. Padding has weight 0.
  enum Column { x, y, z, target_u, target_v, weight, n_columns };
  size_t padded_size() const { return padded_; }
  Real* column(Column k) { return values_.get() + k * padded_; }
  const Real* column(Column k) const { return values_.get() + k * padded_; }

 private:
  PinholeCamera camera_;
  size_t size_ = 0;
  size_t padded_ = 0;
  std::unique_ptr<Real[]> values_;
};

using ReprojectionData = ReprojectionPoints<double>;
using RoughReprojectionData = ReprojectionPoints<float>;

template <typename Real>
NormalEquations accumulate(const ReprojectionPoints<Real>& data, const SE3& T_curr_prev,
                           const HuberKernel& kernel);

template <typename Real>
SolverResult minimize_reprojection(const ReprojectionPoints<Real>& data, const SE3& start,
                                   const HuberKernel& kernel, const SolverOptions& options);

/// Computes the reprojection error eu, ev of each point (px): project(X m) - p - phi; +inf behind the camera
/// and for padding.
void reprojection_errors(const RoughReprojectionData& data, const SE3& T_curr_prev, std::vector<float>& eu,
                         std::vector<float>& ev);

/// Returns the number of points within `threshold_px`. Stops early, with a result below `at_least`, once
/// `at_least` cannot be reached any more, or once the number of inliers so far is more than four standard
/// deviations too small for it. The second rule requires that `data` is in random order.
int count_inliers(const RoughReprojectionData& data, const SE3& T_curr_prev, double threshold_px,
                  int at_least);

}  // namespace sextant
