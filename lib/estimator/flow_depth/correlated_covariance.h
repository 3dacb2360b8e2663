#pragma once

// The option `covariance` of every estimator: whether errors count as independent from point to point, or as
// correlated over the image (correlated_errors.h): as the problem declares, and as the residuals show where
// it declares no level of the flow. Points and status are the same, and so is the motion of motion_only and
// joint_flow. joint_flow_depth takes a step of generalised least squares from there (correlated_weights.h).

#include <memory>
#include <optional>

#include "sextant/estimator/flow_depth/error_model.h"
#include "sextant/estimator/flow_depth/errors_in_variables.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/solvers/robust_kernel.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Of motion_only and joint_flow, whose optimum with this kernel `estimate` holds.
void correlate(const Problem& problem, const HuberKernel& kernel, MotionEstimate& estimate);

struct CorrelatedEstimate {
  SE3 T_curr_prev;
  bool moved = false;                      ///< from X
  Matrix6d covariance = Matrix6d::Zero();  ///< of the left twist; infinite where points do not determine it
  std::shared_ptr<const ErrorModel> errors;
};
/// Whether the problem says how its flow errs.
bool declares_errors(const Problem& problem);

/// Of joint_flow_depth, whose optimum for independent errors is X. `points`: of n_points that count those
/// that tell it, evaluated at X: where errors are declared, all. `independent`: what all tell there.
/// `inflation`: of independent errors, by the kernel. `is_weak`: depths do not determine all directions.
/// `known`: what these points need not be asked; may be null. None where errors are declared independent.
std::optional<CorrelatedEstimate> correlate(const Problem& problem, const FlowDepthData& points,
                                            size_t n_points, const NoiseLevels& levels,
                                            const RobustKernel& kernel, const DepthInformation& independent,
                                            double inflation, bool is_weak, const ErrorModel* known,
                                            const SE3& X);

}  // namespace sextant
