#pragma once

// Split-half consistency of a covariance, which needs no ground truth. The body is estimated from each of two
// disjoint halves of its inliers, X_1 and X_2, and
//
//   split NEES = e^T (C_1 + C_2 - C_12 - C_21)^-1 e,   exp(e) = X_1 X_2^-1,
//
// has a mean of 6 if the covariances are correct. A larger mean indicates errors that the covariance does not
// contain. C_12 is the cross-covariance of the halves from errors that correlate over the image
// (error_model.h); it is 0 for estimators without an error model. Halves with an error model use the noise
// levels and error variances that were estimated from the whole body, because its covariance is under test.
// Only inliers of the whole body take part; estimators that choose their points gate each half once more.

#include <optional>

#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

struct SplitNees {
  std::optional<double> sides;  ///< halves left and right of the median column of the inliers
  std::optional<double> cells;  ///< halves of black and white squares of a chess board, 80 px wide
};

/// Returns the NEES of each split; nullopt if a half has no estimate or the covariance of the difference is
/// not positive definite. Each half starts from the motion and the inliers of the whole body.
SplitNees split_nees(const Problem& problem, const MotionEstimate& whole, const Estimator& estimator);

}  // namespace sextant
