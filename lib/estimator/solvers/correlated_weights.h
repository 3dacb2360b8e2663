#pragma once

// Weights of measurements whose errors are correlated over the image: generalised least squares (Aitken 1936).
//
// What errs alike over a body is not told better by more points. With D_i the derivatives of the residuals of point i
// (ErrorScore), S the variances of independent errors and a(p) a smooth error with covariance K in every channel, the
// best linear estimate has the scores
//
//   G_i = W_i (D_i - F(p_i)),   W_i = S^-1 - S^-1 b b^T S^-1 / (b^T S^-1 b),   b: by_depth
//
// F is what smooth errors would take of D: it minimises sum_i (D_i - F)^T W_i (D_i - F) + F^T K^-1 F. It has one value
// in each of a few dozen cells. K is the mean correlation of two cells of side s, whose Gaussians have the variance
// length^2 + s^2 / 6 and the height f = length^2 / (length^2 + s^2 / 6). What varies within a cell counts as independent,
// times the number of points that share it: S holds share (1 - f + (n - 1) min(f, 1 - f)) of a length, for n points a
// cell. With a cell for every point G is that of the full covariance.
//
// Weights that are not the best leave the estimate without bias, and its covariance is made from G and the errors as
// they are, not as cells have them (correlated_errors.h).

#include "sextant/estimator/solvers/error_parts.h"

namespace sextant {

struct WeightedEquations {
  ScoreMatrix curvature = ScoreMatrix::Zero();  ///< sum_i G_i^T D_i
  ScoreVector gradient = ScoreVector::Zero();   ///< sum_i G_i^T residual_i
  double independent = 0;  ///< sum_i D_i^T W_i D_i over sum_i D_i^T D_i, on average over the motion
};

/// Turns the derivatives into G, times `of_each`: the points that each stands for.
WeightedEquations weigh(std::vector<ErrorScore>& points, const ErrorParts& errors, double of_each = 1);

}  // namespace sextant
