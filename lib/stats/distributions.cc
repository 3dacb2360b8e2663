#include "sextant/stats/distributions.h"

#include <cmath>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant {
namespace {

/// Returns x with cdf(x) = p in [low, high] for an increasing cdf, by bisection down to the last bits.
template <typename Cdf>
double invert(Cdf cdf, double p, double low, double high) {
  for (int i = 0; i < 200; ++i) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;
    (cdf(middle) < p ? low : high) = middle;
  }
  return low + (high - low) / 2;
}

/// Returns x^a e^-x / Gamma(a).
double gamma_factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

/// Returns P(a, x) by its power series, which converges fast for x < a + 1.
double gamma_series(double a, double x) {
  double term = 1 / a;
  double sum = term;
  for (double n = a + 1; term > sum * 1e-17; ++n) {
    term *= x / n;
    sum += term;
  }
  return sum * gamma_factor(a, x);
}

/// Returns Q(a, x) = 1 - P(a, x) by Lentz's continued fraction; for x >= a + 1.
double gamma_fraction(double a, double x) {
  constexpr double tiny = 1e-300;
  double b = x + 1 - a;
  double c = 1 / tiny;
  double d = 1 / b;
  double h = d;
  for (int i = 1; i < 100000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = an * d + b;
    if (std::abs(d) < tiny) d = tiny;
    c = b + an / c;
    if (std::abs(c) < tiny) c = tiny;
    d = 1 / d;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-16) break;
  }
  return h * gamma_factor(a, x);
}

/// Returns P(q <= x) of chi-square, the regularised lower incomplete gamma function; relative error below
/// 1e-10.
double chi_square_cdf(double x, double dof) {
  if (x <= 0) return 0;
  const double a = dof / 2;
  return x / 2 < a + 1 ? gamma_series(a, x / 2) : 1 - gamma_fraction(a, x / 2);
}

void check_probability(double p) {
  if (!(p > 0 && p < 1)) fail("quantile of probability {}: must be between 0 and 1", p);
}

}  // namespace

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double normal_quantile(double p) {
  check_probability(p);
  if (p > 0.5) return -normal_quantile(1 - p);  // the lower tail keeps its precision
  return invert(normal_cdf, p, -40, 1e-9);
}

// Finite series of Abramowitz and Stegun 26.7.3-4.
double student_t_cdf(double x, int dof) {
  if (dof < 1) fail("Student's t: degrees of freedom {}: must be >= 1", dof);
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

double student_t_quantile(double p, int dof) {
  check_probability(p);
  if (dof < 1) fail("Student's t: degrees of freedom {}: must be >= 1", dof);
  if (p > 0.5) return -student_t_quantile(1 - p, dof);
  double low = -1;
  while (student_t_cdf(low, dof) > p && low > -1e12) low *= 2;
  return invert([dof](double x) { return student_t_cdf(x, dof); }, p, low, 1e-9);
}

double chi_square_quantile(double p, double dof) {
  check_probability(p);
  if (!(dof > 0) || !std::isfinite(dof)) fail("chi-square: degrees of freedom {}: must be > 0", dof);
  double high = dof + 1;
  while (chi_square_cdf(high, dof) < p) high *= 2;
  return invert([dof](double x) { return chi_square_cdf(x, dof); }, p, 0, high);
}

}  // namespace sextant
