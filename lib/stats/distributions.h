#pragma once

// Distribution functions for tests and intervals. Arguments outside the stated ranges throw Error. Boost.Math
// has all of them, most of them faster (bench/statistics_bench.cc), but its values differ by 1e-16 to 1e-13,
// which would change the last digits of intervals in published tables; one interval evaluates only a handful
// of them.

namespace sextant {

/// Returns P(n <= x) of the standard normal distribution, and its inverse (0 < p < 1).
double normal_cdf(double x);
double normal_quantile(double p);

/// Returns q with P(chi-square with `dof` > 0 degrees of freedom <= q) = p, 0 < p < 1.
double chi_square_quantile(double p, double dof);

/// Returns P(T <= x) of Student's t with `dof` >= 1 degrees of freedom.
double student_t_cdf(double x, int dof);
/// Returns t with P(T <= t) = p of Student's t with `dof` >= 1 degrees of freedom, 0 < p < 1.
double student_t_quantile(double p, int dof);

}  // namespace sextant
