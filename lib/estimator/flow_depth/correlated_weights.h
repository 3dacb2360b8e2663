#pragma once

// Weights of measurements whose errors are correlated over the image: generalised least squares (Aitken
// 1936).
//
// What errs alike over a body is not told better by more points. With D_i the derivatives of the residuals of
// point i (ErrorScore), S the variances of independent errors and a(p) a smooth error with covariance K in
// every channel, the best linear estimate has the scores
//
//   G_i = W_i (D_i - F(p_i)),   W_i = S^-1 - S^-1 b b^T S^-1 / (b^T S^-1 b),   b: by_depth
//
// F is what smooth errors would take of D: it minimises sum_i (D_i - F)^T W_i (D_i - F) + F^T K^-1 F. It has
// one value in each of a few dozen cells. K is the mean correlation of two cells of side s, whose Gaussians
// have the variance length^2 + s^2 / 6 and the height f = length^2 / (length^2 + s^2 / 6). What varies within
// a cell counts as independent, times the number of points that share it: S holds share (1 - f + (n - 1)
// min(f, 1 - f)) of a length, for n points a cell. With a cell for every point G is that of the full
// covariance.
//
// Weights that are not the best leave the estimate without bias, and its covariance is made from G and the
// errors as they are, not as cells have them (correlated_errors.h).

#include <cstddef>
#include <vector>

#include "sextant/estimator/flow_depth/error_model.h"
#include "sextant/geometry/lanes.h"

namespace sextant {

struct WeightedEquations {
  ScoreMatrix curvature = ScoreMatrix::Zero();  ///< sum_i G_i^T D_i
  ScoreVector gradient = ScoreVector::Zero();   ///< sum_i G_i^T residual_i
  double independent = 0;  ///< sum_i D_i^T W_i D_i over sum_i D_i^T D_i, on average over the motion
};

/// Turns the derivatives into G, times `of_each`: the points that each stands for.
WeightedEquations weigh(std::vector<ErrorScore>& points, const ErrorParts& errors, double of_each = 1);

// A X = B for a symmetric positive definite A of some dozen unknowns and a few right sides, by A = L L^T
// (Cholesky). Two to three times as fast as Eigen's, which has no clone for AVX (bench/solver_bench,
// `cholesky`), and equal to it within rounding.

class PositiveDefiniteSystem {
 public:
  static constexpr size_t max_right_sides = 2 * n_lanes;

  explicit PositiveDefiniteSystem(size_t n_unknowns);  ///< A = 0, B = 0

  /// Below or on the diagonal; what lies above is not read.
  double& left(size_t row, size_t column) { return values_[column * n_rows_ + row]; }
  double& right(size_t row, size_t side) { return values_[row * n_rows_ + n_padded_ + side]; }

  /// Turns `right` into X. False, and nothing of use, if A is not positive definite.
  [[nodiscard]] bool solve();

 private:
  size_t n_padded_, n_rows_;
  std::vector<double> values_;  ///< by columns: A, whose padding is the unit matrix, and below it B^T
};

}  // namespace sextant
