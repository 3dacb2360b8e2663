#pragma once

// How the errors of one body's measurements were taken, and what they do to its motion: the twist (left) errs by
//
//   sum_i to_twist G_i^T n_i + to_twist by_offset o
//
// with G_i the derivatives of `scores` by the motion, n_i the errors of the channels of a point in their standard
// deviations (levels, parts), o a common offset of the disparities (px).

#include <vector>

#include "sextant/estimator/solvers/error_parts.h"
#include "sextant/estimator/solvers/flow_depth_points.h"

namespace sextant {

struct ErrorModel {
  NoiseLevels levels;
  ErrorParts parts;
  double squared_offset_px2 = 0;  ///< of o, beyond what its estimate errs

  std::vector<ErrorScore> scores;
  Vector6d by_offset = Vector6d::Zero();
  Matrix6d to_twist = Matrix6d::Zero();
};

/// C12 + C21 of the errors that two motions from disjoint points have in common, in the coordinates to * twist.
Matrix6d common_errors(const ErrorModel& first, const ErrorModel& second, const Matrix6d& to);

}  // namespace sextant
