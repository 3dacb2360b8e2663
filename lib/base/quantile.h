#pragma once

// Quantiles. Those of samples that must be checked first: stats/summary.h.

#include <algorithm>
#include <span>

#include "sextant/base/error.h"

namespace sextant {

/// Type 7 of Hyndman and Fan (1996), the default of R and numpy: linear between the order statistics
/// x_(1) <= .. <= x_(n) at position 1 + (n - 1) p. Throws Error unless 0 <= p <= 1; n > 0.
double quantile_of_sorted(std::span<const double> sorted, double p);
/// The same of values in any order, which are brought into another.
double quantile_of(std::span<double> values, double p);

/// One of the values, of which half are below, without the mean of two; brings them into another order.
template <typename Values>
auto middle_of(Values& values) {
  SEXTANT_CHECK(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Quantiles of the chi-square distribution (Wilson & Hilferty 1931; two degrees of freedom: exact).

double chi_square_quantile(int degrees_of_freedom, double probability);

}  // namespace sextant
