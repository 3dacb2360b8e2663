#pragma once

// The literal costs of motion_only and joint_flow in Ceres, with every refined flow as an explicit 2-D
// parameter block (Schur elimination) and automatic derivatives. References for tests of the production
// estimators; slow. All references treat errors as independent, whatever the option `covariance` requests;
// the registry refuses `correlated`. These two throw Error for robust = geman_mcclure_gnc.

#include "sextant/base/options.h"
#include "sextant/estimator/estimators/joint_flow.h"
#include "sextant/estimator/flow_depth/joint_flow_depth.h"

namespace sextant {

class MotionOnlyCeres : public WithOptions<Estimator, MotionOnlyOptions> {
 public:
  explicit MotionOnlyCeres(const MotionOnlyOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
};

class JointFlowCeres : public WithOptions<Estimator, JointFlowOptions> {
 public:
  explicit JointFlowCeres(const JointFlowOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
};

// The literal cost of joint_flow_depth in Ceres: refined flow and depth of a point form one parameter block
// of three numbers, since they share a residual; Schur elimination, automatic derivatives. Points, noise
// levels, kernel and prior (flow_depth_solver.h) are those chosen by decide() of joint_flow_depth. Slow.
//
//   prior + 1/2 sum_i rho( |p_i + phihat_i - project(X m(p_i, z_i))|^2_S1 + |phi_i - phihat_i|^2_S2
//              + D(1/z_i; measured) [ + D(1/z'_i; measured) ] ),   S1 + S2 = diag(sigma_u^2, sigma_v^2)

class JointFlowDepthCeres : public WithOptions<Estimator, JointFlowDepthOptions> {
 public:
  explicit JointFlowDepthCeres(const JointFlowDepthOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
};

}  // namespace sextant
