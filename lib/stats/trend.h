#pragma once

// Growth of errors with the noise level, and the smallest effect that a sample can detect. Empty or
// non-finite samples throw Error.

#include <optional>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

/// Errors at one noise level, as moments by cluster.
struct LevelSums {
  double level = 0;
  ClusterSums clusters;
};

/// Least-squares line error = intercept + slope * level through all errors, with an interval by cluster
/// bootstrap. relative_slope = slope / mean error at the lowest level; nullopt unless that mean is positive,
/// without an interval unless it is positive in every cluster. noise_slope() throws Error if the data or a
/// resample have fewer than two levels (every cluster should have all levels).
struct NoiseSlope {
  double slope = 0;
  std::optional<Interval> interval;
  std::optional<double> relative_slope;
  std::optional<Interval> relative_interval;
};
NoiseSlope noise_slope(std::span<const LevelSums> levels, const BootstrapOptions& options = {});

/// Returns p of Page's trend test (1963), one-sided with growth as the alternative, of blocks (seeds) that
/// each have one value per level, in order of level. Midranks within blocks; L = sum_j j R_j; variance per
/// block sum (j - jbar)^2 sum (r - rbar)^2 / (k - 1), which is exact with ties. p is the share of all
/// permutations of the midranks within the blocks whose L is at least the observed one, for up to 473 blocks
/// of 2 levels, 157 of 3, 67 of 4, 34 of 5 and 20 of 6; otherwise the normal approximation, without
/// continuity correction. p = 1 if the values of every block are equal. Values within a block need not be
/// independent, so that the test suits sweeps whose levels share random numbers. Throws Error unless there is
/// a block and all blocks have the same number k >= 2 of finite values.
double page_trend_test(const std::vector<std::vector<double>>& blocks);

/// Returns the smallest mean of n paired differences with standard deviation `sigma` that a two-sided test at
/// `alpha` detects with probability `power`: (z_{1 - alpha/2} + z_power) sigma / sqrt(n). Uses the normal
/// distribution: somewhat optimistic below n = 20.
double minimum_detectable_effect(double sigma, int n, double alpha = 0.05, double power = 0.8);

/// Returns the interval in which the mean of n NEES values lies with probability `confidence` if the
/// covariances are correct: the tail quantiles of chi-square with n dof degrees of freedom, divided by n.
/// `dof` is the number of degrees of freedom of one NEES value.
Interval nees_interval(int n, int dof, double confidence = 0.95);

}  // namespace sextant
