#pragma once

// Errors in variables of one body (docs/method.md): depths are regressors, and they have errors.
//
//   H = sum_i w_i J_i^T S_i^-1 J_i         at the refined depths
//   B = sum_i w_i var(s_i) J'_i^T S_i^-1 J'_i,   J' = dJ/ds
//
// H counts the spread of the true depths and that of their errors; H - B is what the true depths tell. The
// structured estimate (every depth an unknown) is unbiased with covariance (H-B)^-1 H (H-B)^-1. The one that
// takes the previous depths as measured has covariance H_p^-1 (p: without current depths) about a motion that
// is shrunk towards no parallax within the body.
//
// In directions in which the latter scatters less - far or flat bodies - the structured estimate is drawn
// towards it as far as the two do not contradict each other:
//
//   x = x_measured + share (x_structured - x_measured),   share = max(0, 1 - (3 / z)^2)
//
// z: their difference over its own standard deviation, from
//   cov(x_structured - x_measured) = (H-B)^-1 H (H-B)^-1 + H_p^-1 - 2 sym((H-B)^-1 K H_p^-1),
//   K = H_p - B_p + B: covariance of the two scores.
// In the cost this is a MotionPrior about x_measured of precision lambda (1 - share) / share in units of H;
// lambda: eigenvalues of H^-1 (H - B).
//
// What is held keeps (1 - share) of the mean's bias. The square of that is the difference's less the variance
// of the difference. Where errors correlate, H is not the covariance of scores and that variance is known by
// its size only: a tenth of it is taken off. Where the relief is not significant (lambda), the structured
// estimate tells nothing of the bias: then it is the difference, give or take its standard deviation.

#include <optional>

#include "sextant/estimator/flow_depth/flow_depth_solver.h"

namespace sextant {

struct DepthInformation {
  Matrix6d total = Matrix6d::Zero();   ///< H
  Matrix6d errors = Matrix6d::Zero();  ///< B

  /// Of so many times the points.
  DepthInformation times(double more) const { return {more * total, more * errors}; }
};
/// Where `data` was evaluated last, T_curr_prev with these levels (evaluate_points).
template <typename Real>
DepthInformation depth_information(const FlowDepthPoints<Real>& data, const SE3& T_curr_prev,
                                   const NoiseLevels& levels, const RobustKernel& kernel);

/// The motion that takes depths as measured, by Gauss-Newton with weights S_i^-1; none if that leads nowhere.
std::optional<SE3> motion_of_measured_depths(FlowDepthData& data, const SE3& start, NoiseLevels levels,
                                             const RobustKernel& kernel);

/// Whether some direction is so little determined by the true depths that it may have to be held.
bool has_weak_directions(const DepthInformation& information);

enum class Scores { independent, correlated };

/// What holds them: `mean`, of precision 0 where a direction is determined. `information`: of the structured
/// estimate; `measured`: of the mean, which takes n_points depths as measured; `gradient`: of the structured
/// cost at it.
MotionPrior hold_weak_directions(const SE3& mean, const DepthInformation& information,
                                 const DepthInformation& measured, const Vector6d& gradient, size_t n_points,
                                 Scores scores);

/// The same from points whose errors are independent.
MotionPrior weak_directions(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                            const RobustKernel& kernel);

/// Of the left twist of the optimum, from errors of measurements and what is known of the bias; infinite
/// where a direction is not determined.
Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior);
/// The same where the scores of all measurements, with those of the prior's mean, have the covariance
/// `scores`.
Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior,
                           const Matrix6d& scores);

}  // namespace sextant
