#pragma once

// The option `covariance` of every estimator: whether errors count as independent from point to point, or as
// correlated over the image (correlated_errors.h): as the problem declares, and as the residuals show where it
// declares no level of the flow. The motion, its points and its status are the same.

#include "sextant/base/names.h"
#include "sextant/estimator/solvers/errors_in_variables.h"
#include "sextant/estimator/solvers/huber.h"
#include "sextant/estimator/solvers/motion_estimate.h"
#include "sextant/measurement/problem.h"

namespace sextant {

enum class CovarianceOf { independent, correlated };
constexpr Names<2> names_of(CovarianceOf) { return {"independent", "correlated"}; }

inline constexpr const char* covariance_meaning =
    "errors of the points: independent, or correlated over the image, as declared, else as the residuals show";

/// Of motion_only and joint_flow, whose optimum with this kernel `estimate` holds.
void correlate(const Problem& problem, const HuberKernel& kernel, MotionEstimate& estimate);

/// Of joint_flow_depth. `points`: those that count, evaluated at the motion. `inflation`: of independent errors, by
/// the kernel.
void correlate(const Problem& problem, const FlowDepthData& points, const NoiseLevels& levels,
               const RobustKernel& kernel, const MotionPrior& prior, const DepthInformation& information,
               double inflation, MotionEstimate& estimate);

}  // namespace sextant
