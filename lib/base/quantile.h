#pragma once

// Quantiles of samples without NaN, which these functions do not check; those of stats/summary.h do.

#include <algorithm>
#include <span>

#include "sextant/base/error.h"

namespace sextant {

/// Returns the quantile by type 7 of Hyndman and Fan (1996), the default of R and numpy: linear interpolation
/// between the order statistics x_(1) <= .. <= x_(n) at position 1 + (n - 1) p. Throws Error unless
/// 0 <= p <= 1, and InternalError for an empty sample.
double quantile_of_sorted(std::span<const double> sorted, double p);
/// Returns the quantile of values in any order, with the same definition and errors. Reorders the values.
double quantile_of(std::span<double> values, double p);

/// Returns the upper median: the element at index n / 2 of the sorted values, without averaging two elements
/// for even n. Reorders the values. Throws InternalError if there are none.
template <typename Values>
auto upper_median(Values& values) {
  SEXTANT_CHECK(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the quantile `p` of the chi-square distribution with `dof` degrees of freedom for gates of
/// residuals: by the exact formula for two degrees of freedom, otherwise by the approximation of Wilson and
/// Hilferty (1931). With three degrees of freedom its error is below 0.7 % up to p = 0.99, and 1.8 % at
/// p = 0.999. Tests and intervals use chi_square_quantile() of stats/tests.h, which is exact.
double approximate_chi_square_quantile(double p, int dof);

}  // namespace sextant
