#include "sextant/base/quantile.h"

#include <cmath>

namespace sextant {
namespace {

/// Position of the quantile p among n sorted values: index of the lower neighbour, and the interpolation
/// weight of the upper one.
struct Position {
  size_t below;
  double share;
};

Position position_of(double p, size_t n) {
  SEXTANT_CHECK(n > 0);
  if (!(p >= 0 && p <= 1)) fail("quantile {}: must be in 0..1", p);
  const double position = static_cast<double>(n - 1) * p;
  const size_t below = std::min(static_cast<size_t>(position), n - 1);
  return {below, position - static_cast<double>(below)};
}

}  // namespace

double quantile_of_sorted(std::span<const double> sorted, double p) {
  const auto [below, share] = position_of(p, sorted.size());
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

double quantile_of(std::span<double> values, double p) {
  const auto [below, share] = position_of(p, values.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), middle, values.end());
  const double above = middle + 1 == values.end() ? *middle : *std::min_element(middle + 1, values.end());
  return *middle + share * (above - *middle);
}

double approximate_chi_square_quantile(double p, int dof) {
  // Normal quantile by bisection of erfc: called a few times per estimate.
  double low = -10;
  double high = 10;
  for (int k = 0; k < 60; ++k) {
    const double x = 0.5 * (low + high);
    (0.5 * std::erfc(-x / std::sqrt(2.0)) < p ? low : high) = x;
  }
  if (dof == 2) return -2 * std::log1p(-p);
  const double h = 2.0 / (9.0 * dof);
  return dof * std::pow(1 - h + low * std::sqrt(h), 3);
}

}  // namespace sextant
