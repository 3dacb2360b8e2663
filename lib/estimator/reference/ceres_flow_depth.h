#pragma once

// joint_flow_depth's cost written literally in Ceres: refined flow and depth of every point are a parameter
// block (one of three numbers, since they share a residual), Schur elimination, automatic derivatives.
// Points, noise levels and kernel are those that joint_flow_depth decides on. Slow.
//
//   sum_i rho( |p_i + phihat_i - project(X m(p_i, z_i))|^2_S1 + |phi_i - phihat_i|^2_S2
//              + D(1/z_i; measured) [ + D(1/z'_i; measured) ] ),   S1 + S2 = diag(sigma_u^2, sigma_v^2)

#include "sextant/base/with_options.h"
#include "sextant/estimator/estimators/joint_flow_depth.h"

namespace sextant {

class JointFlowDepthCeres : public WithOptions<Estimator, JointFlowDepthOptions> {
 public:
  explicit JointFlowDepthCeres(const JointFlowDepthOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
};

}  // namespace sextant
