#pragma once

// Bootstrap intervals (Efron and Tibshirani 1993) of a statistic of independent clusters. A cluster is what
// was drawn independently: in a sweep a seed, whose frames share their noise's key and so belong together.
// Single independent values are clusters of one.
//
//   replicate r   as many clusters as there are, drawn with replacement; its statistic is theta*_r
//   tail          alpha' = Phi(sqrt(n / (n - 1)) t_{n-1}(alpha/2)), alpha = 1 - confidence, n clusters:
//                 resampling is too narrow by the factor sqrt((n - 1) / n) and knows no t distribution
//                 (Hesterberg 2015)
//   percentile    type 7 quantiles of theta* at alpha' and 1 - alpha'
//   bca           the same at levels corrected for bias z0 (share of theta* below theta, ties half) and for
//                 acceleration a (jackknife over clusters): Phi(z0 + (z0 + z) / (1 - a (z0 + z)))
//
// Replicate r has its own stream of Philox numbers: the interval is a pure function of data and options.
// With fewer than 2 clusters nothing is known of the spread: no interval.
// More than max_clusters clusters are joined to that many groups before (clustered_sample.h).

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sextant/base/options.h"

namespace sextant {

enum class BootstrapMethod { bca, percentile };
constexpr Names<2> names_of(BootstrapMethod) { return {"bca", "percentile"}; }

struct BootstrapOptions {
  SEXTANT_OPTIONS(
      (int, replicates, 2000, "count", "resamples"),
      (double, confidence, 0.95, "0..1", "share of intervals that hold the true value"),
      (BootstrapMethod, method, BootstrapMethod::bca, "", "of the interval"),
      (uint64_t, seed, 1, "", "of the resampling"))
  void check() const;
};

struct Interval {
  double low = 0;
  double high = 0;
};

/// A statistic of the clusters with the given indices (with repetition, never empty). It must be finite; a
/// value that is not throws Error.
using ClusterStatistic = std::function<double(std::span<const size_t> clusters)>;

std::optional<Interval> cluster_bootstrap(size_t n_clusters, const ClusterStatistic& statistic,
                                          const BootstrapOptions& options = {});

/// Several statistics of the same resamples, each with its own interval; equal to one at a time.
using ClusterStatistics = std::function<void(std::span<const size_t> clusters, std::span<double> statistics)>;
std::vector<std::optional<Interval>> cluster_bootstrap(size_t n_clusters, size_t n_statistics,
                                                       const ClusterStatistics& statistics,
                                                       const BootstrapOptions& options = {});

/// A number with its interval; none where nothing is known of the spread.
struct IntervalEstimate {
  double value = 0;
  std::optional<Interval> interval;
};
/// The statistic of all clusters, and its interval.
IntervalEstimate cluster_estimate(size_t n_clusters, const ClusterStatistic& statistic,
                                  const BootstrapOptions& options = {});
std::vector<IntervalEstimate> cluster_estimates(size_t n_clusters, size_t n_statistics,
                                                const ClusterStatistics& statistics,
                                                const BootstrapOptions& options = {});

using Statistic = std::function<double(std::span<const double>)>;

/// Independent values.
std::optional<Interval> bootstrap(std::span<const double> values, const Statistic& statistic,
                                  const BootstrapOptions& options = {});

/// Values in clusters: values[i] belongs to the cluster labelled cluster[i] (a seed). The statistic sees all
/// values of the drawn clusters. Throws Error for an empty or non-finite sample.
std::optional<Interval> bootstrap_by_cluster(std::span<const double> values,
                                             std::span<const uint64_t> cluster, const Statistic& statistic,
                                             const BootstrapOptions& options = {});

/// Indices of the values of each cluster, clusters in order of their label.
std::vector<std::vector<size_t>> members_of_clusters(std::span<const uint64_t> cluster);

}  // namespace sextant
