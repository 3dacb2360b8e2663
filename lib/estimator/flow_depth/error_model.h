#pragma once

// Correlation of a body's errors, estimated from its own residuals.
//
// Errors of flow and disparity have no single correlation length: those of networks and matchers range over 8
// to 128 px (results/profiles), and one body has too few independent patches to distinguish such lengths. The
// shape of the correlation is therefore fixed, 0.6 of 20 px and 0.4 of 100 px. Two variances are estimated
// for each kind of measurement (flow u, flow v and disparity): of the errors that are independent between
// points, and of the correlated ones.
//
// The method is minimum norm quadratic unbiased estimation (Rao 1971): with residuals y, the projection R
// onto the residuals of a fit, and the correlation K_a of component a within its kind, T_a = y^T K_a y has
// the expectation sum_b tr(K_a R K_b R) variance_b. It thereby accounts for the degrees of freedom used by
// the fit. Variances are >= 0.
//
// - Correlated variances are raised by 2.5 of the standard deviations that their estimates have for
//   independent errors, at the expense of the independent variance (at most all of it): weights would
//   otherwise overfit small estimates, and real errors do not have exactly this shape.
// - Points are weighted by the correlated variances only if one of these was above two standard deviations
//   before it was raised (`significant`), so that little is lost for independent errors. The covariance
//   always includes correlated errors: real errors are correlated, even if a body's residuals do not show it.
// - A kind whose variance is uncertain by more than itself gets the mean variances of the other kinds.
//
// Disparity errors that persist. The residuals show the errors of the disparities in the differences
// between the two frames. An error that is the same in both frames at a point of the surface cancels in
// these differences, but it distorts the shape of the body, and with it the motion that the flow
// determines. Its variance cannot be estimated from one pair of frames; it is assumed to be
// `persistent_ratio` times the variance of the errors that do not persist. The errors of SGBM against the
// true disparities of two pairs of KITTI scene flow have the ratio 1.0 to 2.9 (test PersistentErrors of
// profile_test). The covariance of bodies whose disparities are compared in both frames includes these
// errors; the weights of the points do not depend on them.
//
// With nu = tr(R S)^2 / tr(R S R S), S = sum_a variance_a K_a of a kind (Satterthwaite 1946), a normalised
// squared error is larger by nu / (nu - 2) on average if its variance was estimated with nu degrees of
// freedom. Variances are multiplied by that factor.

#include <vector>

#include "sextant/estimator/flow_depth/correlated_errors.h"
#include "sextant/estimator/flow_depth/flow_depth_points.h"

namespace sextant {

/// Variances of the errors by channel, in units of the assumed variance.
struct ErrorParts {
  Lanes independent = {1, 1, 1, 1};
  Lanes correlated = {0, 0, 0, 0};
  std::vector<SpatialCorrelation::Part> shape;  ///< correlation of the correlated errors
  bool significant = true;  ///< true if a correlated variance exceeds what independent errors would show
  double persistent = 0;    ///< variance of the disparity error that both frames share, over delta_d_px^2

  /// Returns true if a channel has correlated errors.
  bool correlate() const;

  /// Increases the independent variance of each channel until the total is at least `variance`.
  void raise_to(double variance);
};

/// Variance of the disparity errors that persist, divided by the variance of the errors that do not persist.
inline constexpr double persistent_ratio = 2;

/// Estimates the variances from the residuals, without persistent errors. Returns independent errors of
/// variance 1 for fewer than twelve points, and if the points do not determine the motion or any
/// variance.
ErrorParts estimate_error_parts(const std::vector<ErrorScore>& points);

// Error model of one body: the assumed errors of its measurements and their effect on its motion. The error
// of the left twist is
//
//   sum_i to_twist G_i^T n_i + to_twist by_offset o
//
// with G_i the derivatives of `scores` with respect to the motion, n_i the errors of the channels of a point
// in standard deviations (levels, parts), and o a common offset of the disparities (px).

struct ErrorModel {
  NoiseLevels levels;
  ErrorParts parts;
  double squared_offset_px2 = 0;  ///< square of o minus the variance of its estimate; at least 0

  std::vector<ErrorScore> scores;
  Vector6d by_offset = Vector6d::Zero();
  Matrix6d to_twist = Matrix6d::Zero();
};

/// Returns M (correlated_errors.h) of the correlated and the persistent errors.
ScoreMatrix smooth_error_scores(const std::vector<ErrorScore>& scores, const ErrorParts& parts,
                                const NoiseLevels& levels);

/// Returns C12 + C21, the cross-covariance of two motions from disjoint points whose errors are
/// correlated, in the coordinates `to` * twist.
Matrix6d common_errors(const ErrorModel& first, const ErrorModel& second, const Matrix6d& to);

}  // namespace sextant
