#pragma once

// How errors change with the noise level, and how much can be seen at all.
// Empty or non-finite samples throw Error.

#include <optional>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

/// The errors at one level, as sums by cluster.
struct LevelSums {
  double level = 0;
  ClusterSums clusters;
};

/// Least squares line error = intercept + slope * level through all errors, interval by cluster bootstrap.
/// relative_slope = slope / mean error at the lowest level: none where that mean is not above 0. Throws Error
/// where there are fewer than two levels, in the data or in a resample (a cluster should have all levels).
struct NoiseSlope {
  double slope = 0;
  double intercept = 0;
  std::optional<Interval> interval;
  std::optional<double> relative_slope;
  std::optional<Interval> relative_interval;
};
NoiseSlope noise_slope(std::span<const LevelSums> levels, const BootstrapOptions& options = {});

/// z is above 0 for growing values; p is one-sided, against growth.
struct TrendTest {
  double statistic = 0;
  double z = 0;
  double p = 1;
};

/// Page (1963): blocks (seeds) that each have one value per level, in order of level. Midranks within blocks;
/// L = sum_j j R_j; variance per block sum (j - jbar)^2 sum (r - rbar)^2 / (k - 1), so ties are exact. Normal
/// approximation. For sweeps with common random numbers, whose levels share draws: the blocks need not
/// be independent within. Throws Error unless all blocks have the same k >= 2 values.
TrendTest page_trend_test(const std::vector<std::vector<double>>& blocks);

/// Smallest mean of n paired differences of standard deviation `sigma` that a two-sided test at `alpha` finds
/// with probability `power`: (z_{1 - alpha/2} + z_power) sigma / sqrt(n).
/// Normal: somewhat optimistic below n = 20.
double minimum_detectable_effect(double sigma, int n, double alpha = 0.05, double power = 0.8);

/// Where the mean of n NEES values with `dof` degrees of freedom each lies with probability `confidence` if
/// the covariances are right: quantiles of chi-square(n dof) / n.
Interval nees_interval(int n, int dof, double confidence = 0.95);

}  // namespace sextant
