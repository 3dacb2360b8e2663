#pragma once

// Minimises the robust reprojection cost of one rigid body over X = T_curr_prev (paper eq. (4), (10)):
//
//   C(X) = 1/2 sum_i h(p_i + phi_i - project(X m_i)),  m_i = backproject(p_i, d_i),  h: huber.h
//
// Levenberg-Marquardt on SE(3), left perturbation X <- exp(xi) X, analytic Jacobians, Newton weights of the
// kernel: I/s^2 inside, k/(s|r|) (I - r r^T/|r|^2) outside, which is the exact (semi-definite) Hessian of h.
// A step that brings a point behind the camera is refused. Units: px, m, rad.

#include <vector>

#include "sextant/estimator/huber.h"
#include "sextant/estimator/levenberg_marquardt.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Points and targets as padded structure of arrays, ready for the vectorised loops below.
class ReprojectionData {
 public:
  /// Takes the points with keep[i] != 0 (all if keep is empty).
  ReprojectionData(const Problem& problem, const std::vector<unsigned char>& keep);

  size_t size() const { return size_; }
  const PinholeCamera& camera() const { return camera_; }

  static constexpr size_t lanes = 4;
  /// Arrays of a multiple of `lanes` entries. Padding has weight 0.
  const double* x() const { return x_.data(); }
  const double* y() const { return y_.data(); }
  const double* z() const { return z_.data(); }
  const double* target_u() const { return target_u_.data(); }
  const double* target_v() const { return target_v_.data(); }
  const double* weight() const { return weight_.data(); }
  size_t padded_size() const { return x_.size(); }

 private:
  PinholeCamera camera_;
  size_t size_ = 0;
  std::vector<double> x_, y_, z_, target_u_, target_v_, weight_;
};

NormalEquations accumulate(const ReprojectionData& data, const SE3& T_curr_prev, const HuberKernel& kernel);

SolverResult minimize_reprojection(const ReprojectionData& data, const SE3& start, const HuberKernel& kernel,
                                   const SolverOptions& options);

/// Per point of `data` (in order): squared reprojection error, px^2; +inf behind the camera.
void squared_errors(const ReprojectionData& data, const SE3& T_curr_prev, std::vector<double>& errors);

/// Number of points within `threshold_px`. Stops early, returning less than `at_least`, once `at_least` is
/// out of reach; or, if `data` is in random order, once the points seen so far say so beyond four standard
/// deviations.
int count_inliers(const ReprojectionData& data, const SE3& T_curr_prev, double threshold_px, int at_least);

}  // namespace sextant
