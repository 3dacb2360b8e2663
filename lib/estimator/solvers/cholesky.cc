#include "sextant/estimator/solvers/cholesky.h"

#include <cmath>

namespace sextant {
namespace {

/// L, and below it (L^-1 B)^T; four columns at a time.
SEXTANT_SIMD bool factorize(double* values, size_t n, size_t n_rows) {
  for (size_t block = 0; block < n; block += n_lanes) {
    double* const columns = values + block * n_rows;
    // Takes off what the columns before have.
    for (size_t row = block; row < n_rows; row += n_lanes) {
      Lanes sum[n_lanes];
      for (size_t c = 0; c < n_lanes; ++c) sum[c] = SEXTANT_LOAD(columns + c * n_rows + row);
      const double* before = values;
      for (size_t k = 0; k < block; ++k, before += n_rows) {
        const Lanes own = SEXTANT_LOAD(before + row);
        for (size_t c = 0; c < n_lanes; ++c) sum[c] -= own * before[block + c];
      }
      for (size_t c = 0; c < n_lanes; ++c) SEXTANT_STORE(columns + c * n_rows + row, sum[c]);
    }
    for (size_t c = 0; c < n_lanes; ++c) {
      double* const column = columns + c * n_rows;
      const double pivot = column[block + c];
      if (!(pivot > 0)) return false;
      const double scale = 1 / std::sqrt(pivot);
      for (size_t row = block; row < n_rows; row += n_lanes)
        SEXTANT_STORE(column + row, SEXTANT_LOAD(column + row) * scale);
      for (size_t d = c + 1; d < n_lanes; ++d) {
        const double factor = column[block + d];
        double* const other = columns + d * n_rows;
        for (size_t row = block; row < n_rows; row += n_lanes)
          SEXTANT_STORE(other + row, SEXTANT_LOAD(other + row) - factor * SEXTANT_LOAD(column + row));
      }
    }
  }
  return true;
}

/// X^T from (L^-1 B)^T.
SEXTANT_SIMD void substitute_back(double* values, size_t n, size_t n_rows) {
  for (size_t k = n; k-- > 0;) {
    const double* const column = values + k * n_rows;
    double* const own = values + k * n_rows + n;
    Lanes first = SEXTANT_LOAD(own), second = SEXTANT_LOAD(own + n_lanes);
    for (size_t row = k + 1; row < n; ++row) {
      const double* const known = values + row * n_rows + n;
      first -= column[row] * SEXTANT_LOAD(known);
      second -= column[row] * SEXTANT_LOAD(known + n_lanes);
    }
    SEXTANT_STORE(own, first / column[k]);
    SEXTANT_STORE(own + n_lanes, second / column[k]);
  }
}

}  // namespace

PositiveDefiniteSystem::PositiveDefiniteSystem(size_t n_unknowns)
    : n_padded_((n_unknowns + n_lanes - 1) / n_lanes * n_lanes),
      n_rows_(n_padded_ + max_right_sides),
      values_(n_padded_ * n_rows_, 0.0) {
  for (size_t row = n_unknowns; row < n_padded_; ++row) left(row, row) = 1;
}

bool PositiveDefiniteSystem::solve() {
  if (!factorize(values_.data(), n_padded_, n_rows_)) return false;
  substitute_back(values_.data(), n_padded_, n_rows_);
  return true;
}

}  // namespace sextant
