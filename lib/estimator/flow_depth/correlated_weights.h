#pragma once

// Weights of measurements with errors that are correlated over the image: generalised least squares (Aitken
// 1936).
//
// Common-mode error does not average out over points. With D_i the derivatives of the residuals of point i
// (ErrorScore), S the variances of independent errors and a(p) a smooth error with covariance K in every
// channel, the best linear estimate has the scores
//
//   G_i = W_i (D_i - F(p_i)),   W_i = S^-1 - S^-1 b b^T S^-1 / (b^T S^-1 b),   b: by_depth
//
// F is the part of D that smooth errors can explain: it minimises sum_i (D_i - F)^T W_i (D_i - F) + F^T K^-1
// F and is constant in each of at most 24 cells. K is the mean correlation of two cells of side s, whose
// Gaussians have the variance length^2 + s^2 / 6 and the height f = length^2 / (length^2 + s^2 / 6).
// Variation within a cell is treated as independent, multiplied by the number of points that share it: S
// contains share (1 - f + (n - 1) min(f, 1 - f)) of the correlated variance for each length, where n is the
// mean number of points per cell. With one cell per point, G is that of the full covariance.
//
// Suboptimal weights leave the estimate unbiased; its covariance is computed from G and the actual errors,
// not from their approximation by cells (correlated_errors.h).

#include <cstddef>
#include <vector>

#include "sextant/estimator/flow_depth/error_model.h"
#include "sextant/geometry/lanes.h"

namespace sextant {

struct WeightedEquations {
  ScoreMatrix curvature = ScoreMatrix::Zero();  ///< sum_i G_i^T D_i
  ScoreVector gradient = ScoreVector::Zero();   ///< sum_i G_i^T residual_i
  /// trace of sum_i D_i^T W_i D_i over that of sum_i D_i^T D_i, for the motion alone
  double independent = 0;
};

/// Replaces the derivatives of `points` by G, multiplied by `of_each`, the number of points that each score
/// represents; returns the equations of the weighted estimate.
WeightedEquations weigh(std::vector<ErrorScore>& points, const ErrorParts& errors, double of_each = 1);

// Solver of A X = B for a symmetric positive definite A with some dozen unknowns and a few right-hand sides,
// by A = L L^T (Cholesky). Two to three times as fast as Eigen's, which has no AVX clone (bench/solver_bench,
// `cholesky`), and equal to it within rounding.

class PositiveDefiniteSystem {
 public:
  static constexpr size_t max_right_sides = 2 * n_lanes;

  explicit PositiveDefiniteSystem(size_t n_unknowns);  ///< initialises A = 0, B = 0

  /// Entry of A on or below the diagonal; the upper triangle is not read.
  double& left(size_t row, size_t column) { return values_[column * n_rows_ + row]; }
  double& right(size_t row, size_t side) { return values_[row * n_rows_ + n_padded_ + side]; }

  /// Replaces `right` by X. Returns false, with `right` undefined, if A is not positive definite.
  [[nodiscard]] bool solve();

 private:
  size_t n_padded_, n_rows_;
  std::vector<double> values_;  ///< by columns: A, padded with the identity, and below it B^T
};

}  // namespace sextant
