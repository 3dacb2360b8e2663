#pragma once

// Distribution functions that the tests and intervals need. Arguments outside the stated ranges throw Error.

namespace sextant {

/// P(n <= x) of the standard normal, and its inverse (0 < p < 1).
double normal_cdf(double x);
double normal_quantile(double p);

/// P(q <= x) of chi-square with `dof` > 0 degrees of freedom (regularised lower incomplete gamma function:
/// series or continued fraction, relative error below 1e-10), and its inverse (0 < p < 1).
double chi_square_cdf(double x, double dof);
double chi_square_quantile(double p, double dof);

/// P(T <= x) of Student's t with `dof` >= 1 degrees of freedom (finite series, Abramowitz and
/// Stegun 26.7.3-4), and its inverse (0 < p < 1).
double student_t_cdf(double x, int dof);
double student_t_quantile(double p, int dof);

}  // namespace sextant
