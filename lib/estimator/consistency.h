#pragma once

// Whether a covariance can be believed, without any truth: a body is estimated once more from each of two
// disjoint halves of the points that count, X_1 and X_2, and
//
//   split NEES = e^T (C_1 + C_2 - C_12 - C_21)^-1 e,   exp(e) = X_1 X_2^-1,
//
// has a mean of 6 where covariances are right. A larger one means errors that the covariance does not know.
// C_12 is what the halves have in common where errors correlate (error_model.h); 0 for estimators that do not
// say. Halves take the errors as the whole body's points show them: the covariance in question is the
// whole's. Which points count is not asked again.

#include <optional>

#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

struct SplitNees {
  std::optional<double> sides;  ///< left and right of the median pixel of the inliers
  std::optional<double> cells;  ///< odd and even squares of 80 px, as on a chess board
};

/// None where a half has no estimate. Each begins with the motion and the inliers of the whole.
SplitNees split_nees(const Problem& problem, const MotionEstimate& whole, const Estimator& estimator);

}  // namespace sextant
