#include "sextant/stats/distributions.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant {
namespace {

void check_probability(double p) {
  if (!(p > 0 && p < 1)) fail("quantile of probability {}: must be between 0 and 1", p);
}

/// Finite series of Abramowitz and Stegun 26.7.3-4.
double student_t_cdf(double x, int dof) {
  const bool odd = dof % 2 == 1;
  const double angle = std::atan(x / std::sqrt(dof));
  const double c = std::cos(angle);
  // Odd: cos + 2/3 cos^3 + (2 4)/(3 5) cos^5 ..; even: 1 + 1/2 cos^2 + (1 3)/(2 4) cos^4 ..;
  // up to cos^(dof - 2).
  double term = odd ? c : 1;
  double sum = dof == 1 ? 0 : term;
  for (int k = odd ? 3 : 2; k <= dof - 2; k += 2) {
    term *= c * c * (k - 1) / k;
    sum += term;
  }
  const double within = odd ? 2 / std::numbers::pi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
  return 0.5 + within / 2;
}

}  // namespace

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double normal_quantile(double p) {
  check_probability(p);
  return boost::math::quantile(boost::math::normal(), p);
}

double chi_square_quantile(double p, double dof) {
  check_probability(p);
  if (!(dof > 0) || !std::isfinite(dof)) fail("chi-square: degrees of freedom {}: must be > 0", dof);
  return boost::math::quantile(boost::math::chi_squared(dof), p);
}

double student_t_quantile(double p, int dof) {
  check_probability(p);
  if (dof < 1) fail("Student's t: degrees of freedom {}: must be >= 1", dof);
  if (p > 0.5) return -student_t_quantile(1 - p, dof);
  double low = -1;
  while (student_t_cdf(low, dof) > p && low > -1e12) low *= 2;
  double high = 1e-9;
  for (int i = 0; i < 200; ++i) {  // bisection, down to the last bits
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;
    (student_t_cdf(middle, dof) < p ? low : high) = middle;
  }
  return low + (high - low) / 2;
}

}  // namespace sextant
