#include "sextant/estimator/solvers/chi_square.h"

#include <cmath>

namespace sextant {

double chi_square_quantile(int dof, double probability) {
  // Normal quantile by bisection of erfc: called a few times per estimate.
  double low = -10;
  double high = 10;
  for (int k = 0; k < 60; ++k) {
    const double x = 0.5 * (low + high);
    (0.5 * std::erfc(-x / std::sqrt(2.0)) < probability ? low : high) = x;
  }
  if (dof == 2) return -2 * std::log1p(-probability);
  const double h = 2.0 / (9.0 * dof);
  return dof * std::pow(1 - h + low * std::sqrt(h), 3);
}

}  // namespace sextant
