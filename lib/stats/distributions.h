#pragma once

// Distribution functions that the tests and intervals need. Arguments outside the stated ranges throw Error.
// Boost.Math has all of them, mostly faster (bench/statistics_bench.cc), but its numbers are others by 1e-16
// to 1e-13, and so would be the last digits of every interval in a table; an interval asks for a handful of
// them.

namespace sextant {

/// P(n <= x) of the standard normal, and its inverse (0 < p < 1).
double normal_cdf(double x);
double normal_quantile(double p);

/// The q with P(chi-square with `dof` > 0 degrees of freedom <= q) = p, 0 < p < 1.
double chi_square_quantile(double p, double dof);

/// P(T <= x) of Student's t with `dof` >= 1 degrees of freedom.
double student_t_cdf(double x, int dof);
/// The t with P(T <= t) = p of Student's t with `dof` >= 1 degrees of freedom, 0 < p < 1.
double student_t_quantile(double p, int dof);

}  // namespace sextant
