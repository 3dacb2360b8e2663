#pragma once

// How the errors of a body correlate, from its own residuals.
//
// The errors of flow and disparity have no single length: those of networks and matchers correlate over 8 to
// 128 px (results/profiles). One body has too few patches to tell such lengths apart. So the shape of the
// correlation is given, 0.6 of 20 px and 0.4 of 100 px. Estimated are two variances of each kind of
// measurement, flow u, flow v and disparity: of what is independent from point to point and of what
// correlates.
//
// That is minimum norm quadratic unbiased estimation (Rao 1971): with residuals y, R the projection that
// leaves the residuals of a fit, and K_a the correlation of part a within its kind, T_a = y^T K_a y has the
// expectation sum_b tr(K_a R K_b R) variance_b. So it counts what the fit has taken out. Variances are >= 0.
//
//   correlated ones are raised by 2.5 deviations         of independent errors (by all of the kind's at
//                                                        most), at the cost of the independent ones: weights
//                                                        follow what is small, and would trust what only
//                                                        happens to be; and real errors have not just this
//                                                        shape
//   significant: one was above two deviations before     only then points are weighed by them, so that little
//                                                        is lost where errors are independent. The covariance
//                                                        counts them always: real errors correlate, also
//                                                        where a body's residuals do not tell
//   a kind whose variance scatters by more than itself   has the mean variances of the others
//   nu = tr(R S)^2 / tr(R S R S), S = sum_a variance_a K_a of a kind (Satterthwaite 1946): a normalised
//   square of an error is larger by nu / (nu - 2) on average where its variance has nu degrees of freedom.
//   Variances are multiplied by that.

#include <vector>

#include "sextant/estimator/flow_depth/correlated_errors.h"
#include "sextant/estimator/flow_depth/flow_depth_points.h"

namespace sextant {

/// Variances of the errors by channel, in units of the variance they were taken for.
struct ErrorParts {
  Lanes independent = {1, 1, 1, 1};
  Lanes correlated = {0, 0, 0, 0};
  std::vector<SpatialCorrelation::Part> shape;  ///< correlation of the latter
  bool significant = true;                      ///< more than chance makes of independent errors

  bool correlate() const;

  /// Adds to the independent errors of channels that are smaller than that.
  void raise_to(double variance);
};

/// From the residuals of at least twelve points; else, and where they tell nothing, independent ones.
ErrorParts estimate_error_parts(const std::vector<ErrorScore>& points);

// How the errors of one body's measurements were taken, and what they do to its motion: the twist (left) errs
// by
//
//   sum_i to_twist G_i^T n_i + to_twist by_offset o
//
// with G_i the derivatives of `scores` by the motion, n_i the errors of the channels of a point in their
// standard deviations (levels, parts), o a common offset of the disparities (px).

struct ErrorModel {
  NoiseLevels levels;
  ErrorParts parts;
  double squared_offset_px2 = 0;  ///< of o, beyond what its estimate errs

  std::vector<ErrorScore> scores;
  Vector6d by_offset = Vector6d::Zero();
  Matrix6d to_twist = Matrix6d::Zero();
};

/// C12 + C21 of the errors that two motions from disjoint points have in common, in the coordinates
/// to * twist.
Matrix6d common_errors(const ErrorModel& first, const ErrorModel& second, const Matrix6d& to);

}  // namespace sextant
