#pragma once

// What is known of a motion before the points of the final cost speak: a Gaussian about `mean`,
//
//   C(X) += 1/2 xi^T precision xi,   xi = [t - t_m + [t_m]x w; w],  w = 2 vec(q q_m^-1)
//
// which is to first order the left twist of X mean^-1. Units: m, rad.

#include "sextant/estimator/solvers/levenberg_marquardt.h"

namespace sextant {

struct MotionPrior {
  SE3 mean;
  Matrix6d precision = Matrix6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();  ///< of `mean`
  Matrix6d cross = Matrix6d::Zero();       ///< covariance of the points' score and `mean`
  Matrix6d bias = Matrix6d::Zero();        ///< second moment of the bias that pulling to `mean` may cause

  bool holds() const { return !precision.isZero(0); }
};

void add_prior(const MotionPrior& prior, const SE3& T_curr_prev, NormalEquations& equations);

}  // namespace sextant
