#pragma once

// Bootstrap confidence intervals (Efron and Tibshirani 1993) of a statistic of independent clusters. A
// cluster is a group of values that was sampled as a unit: in a sweep all frames of a seed form one cluster,
// because they share the noise of that seed. Independent single values are clusters of one.
//
//   replicate r   as many clusters as there are, drawn with replacement; its statistic is theta*_r
//   tail          alpha' = Phi(sqrt(n / (n - 1)) t_{n-1}(alpha/2)), alpha = 1 - confidence, n clusters:
//                 corrects the bootstrap distribution, which is too narrow by the factor sqrt((n - 1) / n)
//                 and has normal instead of t quantiles (Hesterberg 2015)
//   percentile    type 7 quantiles of theta* at alpha' and 1 - alpha'
//   bca           quantiles at the levels Phi(z0 + (z0 + z) / (1 - a (z0 + z))), z the normal quantiles of
//                 alpha' and 1 - alpha'; corrected for bias z0 (normal quantile of the share of theta* below
//                 theta, ties counted half) and acceleration a (jackknife over clusters)
//
// Replicate r uses Philox stream r, so that the interval is a pure function of data and options. Fewer than 2
// clusters do not determine the spread: there is no interval. ClusteredSample, noise_slope() and
// compare_pairs() first join more than max_clusters clusters to that many groups (clustered_sample.h).

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sextant/base/options.h"

namespace sextant {

enum class BootstrapMethod { bca, percentile };
constexpr Names<2> names_of(BootstrapMethod) { return {"bca", "percentile"}; }

struct BootstrapOptions {
  SEXTANT_OPTIONS((int, replicates, 2000, "count", "resamples"),
                  (double, confidence, 0.95, "0..1", "coverage probability of the interval"),
                  (BootstrapMethod, method, BootstrapMethod::bca, "", "method of the interval"),
                  (uint64_t, seed, 1, "", "seed of the resampling"))
  void check() const;
};

struct Interval {
  double low = 0;
  double high = 0;
};

/// Returns a statistic of the clusters with the given indices (with repetition, never empty). A value that is
/// not finite makes the bootstrap throw Error.
using ClusterStatistic = std::function<double(std::span<const size_t> clusters)>;

std::optional<Interval> cluster_bootstrap(size_t n_clusters, const ClusterStatistic& statistic,
                                          const BootstrapOptions& options = {});

/// Computes several statistics of one resample at a time, as ClusterStatistic computes one. Each statistic
/// gets the interval that a separate bootstrap would give it.
using ClusterStatistics = std::function<void(std::span<const size_t> clusters, std::span<double> statistics)>;
std::vector<std::optional<Interval>> cluster_bootstrap(size_t n_clusters, size_t n_statistics,
                                                       const ClusterStatistics& statistics,
                                                       const BootstrapOptions& options = {});

/// A statistic with its interval; nullopt if the sample does not determine its spread.
struct IntervalEstimate {
  double value = 0;
  std::optional<Interval> interval;
};
/// Returns the statistic of all clusters with its interval.
IntervalEstimate cluster_estimate(size_t n_clusters, const ClusterStatistic& statistic,
                                  const BootstrapOptions& options = {});
std::vector<IntervalEstimate> cluster_estimates(size_t n_clusters, size_t n_statistics,
                                                const ClusterStatistics& statistics,
                                                const BootstrapOptions& options = {});

using Statistic = std::function<double(std::span<const double>)>;

/// Returns the interval of a statistic of independent values, each of which is its own cluster. Throws Error
/// for an empty or non-finite sample; nullopt for fewer than 2 values.
std::optional<Interval> bootstrap(std::span<const double> values, const Statistic& statistic,
                                  const BootstrapOptions& options = {});

}  // namespace sextant
