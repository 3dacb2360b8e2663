#pragma once

// Errors in variables of one body (docs/method.md): depths are regressors that contain errors.
//
//   H = sum_i w_i J_i^T S_i^-1 J_i         at the refined depths
//   B = sum_i w_i var(s_i) J'_i^T S_i^-1 J'_i,   J' = dJ/ds
//
// for point i with inverse depth s_i: J_i is the Jacobian of its measurements (pixel and inverse depth in the
// current frame) with respect to the left twist, S_i their covariance including the effect of the error of
// s_i, and w_i the weight of the robust kernel.
//
// H contains the spread of the true depths plus that of their errors; H - B is the information of the true
// depths. The structured estimate (every depth is an unknown) is unbiased with covariance (H-B)^-1 H
// (H-B)^-1. The estimate that treats the previous depths as exact has covariance H_p^-1 (p: without current
// depths) about a motion that is biased towards no parallax within the body.
//
// In weakly observable directions (distant or flat bodies), where the estimate with exact depths (x_measured)
// has less scatter, the structured estimate is regularised towards it as far as the two are compatible:
//
//   x = x_measured + share (x_structured - x_measured),   share = max(0, 1 - (3 / z)^2)
//
// z: the difference x_structured - x_measured divided by its standard deviation, from
//   cov(x_structured - x_measured) = (H-B)^-1 H (H-B)^-1 + H_p^-1 - 2 sym((H-B)^-1 K H_p^-1),
//   K = H_p - B_p + B: covariance of the two scores.
// In the cost this is a MotionPrior with mean x_measured and precision lambda (1 - share) / share in units of
// H; lambda: eigenvalues of H^-1 (H - B).
//
// A regularised direction retains (1 - share) of the bias of x_measured. The squared bias is the squared
// difference minus the variance of the difference, or 0 if this is negative.

#include <optional>

#include "sextant/estimator/flow_depth/flow_depth_solver.h"

namespace sextant {

struct DepthInformation {
  Matrix6d total = Matrix6d::Zero();   ///< H
  Matrix6d errors = Matrix6d::Zero();  ///< B

  /// Returns the information of `more` times as many points.
  DepthInformation times(double more) const { return {more * total, more * errors}; }
};
/// Returns the information of the included points, for `data` that evaluate_points() has evaluated at
/// T_curr_prev with these levels.
template <typename Real>
DepthInformation depth_information(const FlowDepthPoints<Real>& data, const SE3& T_curr_prev,
                                   const NoiseLevels& levels, const RobustKernel& kernel);

/// Returns the estimate that treats the previous depths as exact, after at most ten Gauss-Newton steps with
/// weights S_i^-1; nullopt if a step is not finite.
std::optional<SE3> motion_of_measured_depths(RoughFlowDepthData& data, const SE3& start, NoiseLevels levels,
                                             const RobustKernel& kernel);

/// Returns true if the true depths determine some direction so weakly that it may need the prior.
bool has_weak_directions(const DepthInformation& information);

/// Returns the prior that regularises weakly observable directions towards `mean`; its precision is 0 in all
/// other directions. `information`: of the structured estimate; `measured`: of `mean`, the estimate that
/// treats the depths of its n_points points as exact; `gradient`: of the structured cost at `mean`.
MotionPrior weak_direction_prior(const SE3& mean, const DepthInformation& information,
                                 const DepthInformation& measured, const Vector6d& gradient, size_t n_points);

/// Returns the prior for the included points, whose errors are independent. Its precision is 0 if depths are
/// exact, no direction is weakly observable, or motion_of_measured_depths() fails.
MotionPrior weak_directions(RoughFlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                            const RobustKernel& kernel);

/// Returns the covariance of the left twist of the optimum, from measurement errors and the possible bias;
/// infinite if a direction is not determined.
Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior);
/// Overload for a given covariance of the score, the gradient of the cost, which includes the error of the
/// prior's mean.
Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior,
                           const Matrix6d& scores);

}  // namespace sextant
