#pragma once

// A X = B for a symmetric positive definite A of some dozen unknowns and a few right sides, by A = L L^T (Cholesky).
// Two to three times as fast as Eigen's, which has no clone for AVX (bench/solver_bench, `cholesky`), and equal to it
// within rounding.

#include <cstddef>
#include <vector>

#include "sextant/geometry/lanes.h"

namespace sextant {

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
