#pragma once

// The loop over points of flow_depth_solver.h.

#include "sextant/estimator/solvers/flow_depth_points.h"
#include "sextant/estimator/solvers/normal_sums.h"
#include "sextant/estimator/solvers/robust_kernel.h"

namespace sextant {

enum class FlowDepthLoop {
  distances,     ///< q only, to first order after one step of the depths
  points,        ///< all that FlowDepthPoints offers per point, depths converged
  rough,         ///< sums; see Curvature
  gauss_newton,  ///< sums
  newton         ///< sums
};

template <typename Real>
NormalSums run_loop(FlowDepthLoop loop, FlowDepthPoints<Real>& points, const SE3& T_curr_prev,
                    const NoiseLevels& levels, const RobustKernel& kernel);

}  // namespace sextant
