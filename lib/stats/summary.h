#pragma once

// Descriptive statistics of a sample x_1..x_n. All throw Error for an empty sample, for values that are not
// finite (a missing value must be left out by the caller, who then counts it) and where n is too small;
// none returns NaN.
//
//   mean      sum x / n                          rmse    sqrt(sum x^2 / n)
//   std_dev   sqrt(sum (x - mean)^2 / (n - 1)), n >= 2
//   quantile  type 7 of Hyndman and Fan (base/quantile.h)
//   median    quantile 1/2
//   mad       median |x - median|; times 1.4826 it estimates sigma of a normal

#include <span>
#include <vector>

#include "sextant/base/quantile.h"

namespace sextant {

double mean(std::span<const double> values);
double rmse(std::span<const double> values);
double std_dev(std::span<const double> values);
/// 0 <= p <= 1.
double quantile(std::span<const double> values, double p);
double median(std::span<const double> values);
double mad(std::span<const double> values);

/// Ranks 1..n; equal values share the mean of theirs (midranks).
std::vector<double> midranks(std::span<const double> values);

/// Throws Error unless there are at least `n_min` values and all are finite. `what` begins the message.
void check_sample(std::span<const double> values, const char* what, size_t n_min = 1);

}  // namespace sextant
