#pragma once

// Option `covariance` of every estimator: errors are independent between points, or correlated over the image
// (correlated_errors.h), as declared by the problem or, if it declares no flow noise, as estimated from the
// residuals. Both cases use the same points; motion_only and joint_flow also return the same motion, whereas
// joint_flow_depth adds a step of generalised least squares (correlated_weights.h). The status changes only
// from ok to no_parallax, if the correlated covariance does not determine the motion.

#include <memory>
#include <optional>

#include "sextant/estimator/flow_depth/error_model.h"
#include "sextant/estimator/flow_depth/errors_in_variables.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/solvers/robust_kernel.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Replaces the covariance of an `estimate` by motion_only or joint_flow, which is the optimum with this
/// kernel.
void correlate(const Problem& problem, const HuberKernel& kernel, MotionEstimate& estimate);

struct CorrelatedEstimate {
  SE3 T_curr_prev;
  bool moved = false;                      ///< true if generalised least squares moved the optimum X
  Matrix6d covariance = Matrix6d::Zero();  ///< covariance of the left twist; infinite if not determined
  std::shared_ptr<const ErrorModel> errors;
};
/// Returns true if the problem declares its flow noise.
bool declares_errors(const Problem& problem);

/// Computes motion and covariance of joint_flow_depth, whose optimum for independent errors is X. Returns
/// nullopt if errors are declared independent.
/// `points`: subset of the n_points inliers used to estimate the error correlation, after evaluate_points()
/// at X; all n_points inliers if errors are declared.
/// `independent`: information of all inliers at X. `inflation`: variance_factor() of the kernel, at least 1.
/// `is_weak`: true if a prior regularises weakly observable directions. `known`: an error model to be used
/// instead of an estimated one; may be null.
std::optional<CorrelatedEstimate> correlate(const Problem& problem, const FlowDepthData& points,
                                            size_t n_points, const NoiseLevels& levels,
                                            const RobustKernel& kernel, const DepthInformation& independent,
                                            double inflation, bool is_weak, const ErrorModel* known,
                                            const SE3& X);

}  // namespace sextant
