#pragma once

// Option `covariance` of every estimator: errors are independent between points, or correlated over the image
// (correlated_errors.h), as declared by the problem or, if it declares no flow noise, as estimated from the
// residuals. Points and status are the same in both cases, and so is the motion of motion_only and
// joint_flow. joint_flow_depth adds a step of generalised least squares (correlated_weights.h).

#include <memory>
#include <optional>

#include "sextant/estimator/flow_depth/error_model.h"
#include "sextant/estimator/flow_depth/errors_in_variables.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/solvers/robust_kernel.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Replaces the covariance of motion_only and joint_flow, for an `estimate` that is their optimum with this
/// kernel.
void correlate(const Problem& problem, const HuberKernel& kernel, MotionEstimate& estimate);

struct CorrelatedEstimate {
  SE3 T_curr_prev;
  bool moved = false;                      ///< true if the motion differs from X
  Matrix6d covariance = Matrix6d::Zero();  ///< covariance of the left twist; infinite if not determined
  std::shared_ptr<const ErrorModel> errors;
};
/// Returns true if the problem declares its flow noise.
bool declares_errors(const Problem& problem);

/// Computes motion and covariance of joint_flow_depth, whose optimum for independent errors is X. Returns
/// nullopt if errors are declared independent.
/// `points`: subset of the n_points inliers used to estimate the error correlation, evaluated at X; all of
/// them if errors are declared.
/// `independent`: information of all inliers at X. `inflation`: factor of the kernel on the covariance of
/// independent errors.
/// `is_weak`: the depths do not determine all directions. `known`: an error model that replaces the estimate;
/// may be null.
std::optional<CorrelatedEstimate> correlate(const Problem& problem, const FlowDepthData& points,
                                            size_t n_points, const NoiseLevels& levels,
                                            const RobustKernel& kernel, const DepthInformation& independent,
                                            double inflation, bool is_weak, const ErrorModel* known,
                                            const SE3& X);

}  // namespace sextant
