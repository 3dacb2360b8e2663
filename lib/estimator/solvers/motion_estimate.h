#pragma once

// What an estimator starts from and what it says, about one body between two frames.

#include <limits>
#include <memory>
#include <vector>

#include "sextant/base/status.h"
#include "sextant/geometry/se3.h"

namespace sextant {

struct ErrorModel;

/// Where a refinement begins: a motion and the points that agree with it.
struct StartingPoint {
  SE3 T_curr_prev;
  std::vector<unsigned char> inliers;  ///< per point; only these are used
  /// What is known of the errors from more points, by joint_flow_depth; none: what these points show.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

struct MotionEstimate {
  Status status = Status::diverged;        ///< ok, diverged, or why the motion is open (degeneracy.h)
  SE3 T_curr_prev;                         ///< maps the body's points, previous to current camera coordinates
  Matrix6d covariance = Matrix6d::Zero();  ///< of the left twist [rho; omega] (m, rad): inverse Gauss-Newton
                                           ///< Hessian at the optimum in the estimator's own sigmas
  /// Of the covariance: largest over smallest eigenvalue. NaN where there is no covariance.
  double condition = std::numeric_limits<double>::quiet_NaN();
  std::vector<unsigned char> inliers;  ///< per point of the problem: 1 = used in the optimisation
  std::vector<double> refined_flow_u;  ///< px, per point; the measured flow where the estimator refines none
  std::vector<double> refined_flow_v;
  int iterations = 0;
  double cost = 0;  ///< at the optimum, in units of variance
  /// What the covariance was made from; none where errors count as independent.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

}  // namespace sextant
