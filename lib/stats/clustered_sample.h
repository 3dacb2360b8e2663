#pragma once

// Moments of each cluster (bootstrap.h). They suffice for means, RMS values and slopes of a sample, whether
// its values are in memory or were summed elsewhere.
//
//   n, sum x, sum x^2   of each cluster, clusters in order of their labels
//
// For intervals, more than max_clusters clusters are joined to that many groups of neighbouring labels of
// nearly equal size. An interval from 2000 groups has a relative error of 1 / sqrt(2 * 2000) = 1.6 %, the
// same as one from 2000 replicates, and costs no more for a million seeds than for 2000.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"

namespace sextant {

struct Moments {
  double n = 0, x = 0, xx = 0;

  void add(double value) {
    n += 1;
    x += value;
    xx += value * value;
  }
  void add(const Moments& more) {
    n += more.n;
    x += more.x;
    xx += more.xx;
  }
  double mean() const { return x / n; }
  double rmse() const { return std::sqrt(xx / n); }
};

struct ClusterSum {
  uint64_t label = 0;
  Moments of;
};
/// One entry per label, in order of label.
using ClusterSums = std::vector<ClusterSum>;

/// Sums the values of each cluster: values[i] belongs to the cluster with label cluster[i]. Throws Error for
/// an empty or non-finite sample.
ClusterSums cluster_sums(std::span<const double> values, std::span<const uint64_t> cluster);

constexpr size_t max_clusters = 2000;
/// Returns the group to which the cluster with this index is joined.
constexpr size_t joined_cluster(size_t index, size_t n_clusters) {
  return n_clusters <= max_clusters ? index : index * max_clusters / n_clusters;
}
/// Returns the moments of each group.
std::vector<Moments> joined_sums(const ClusterSums& clusters);

/// Returns the moments of the clusters with the indices `chosen`, added in this order and with repetition.
Moments total(std::span<const Moments> clusters, std::span<const size_t> chosen);
Moments total(const ClusterSums& clusters);

// A sample in clusters (bootstrap.h), prepared so that a statistic of a resample costs one pass over the
// moments of its clusters, without copying or sorting per replicate. The result equals the statistic
// (summary.h) of the values of the chosen clusters, with repetition.
//
//   mean, rmse   from the moments of the clusters
//   quantile     type 7. A table holds, for every `stride`-th sorted value, how many values of each cluster
//                precede it. These counts locate the stretch of sorted values that contains the quantile, and
//                only this stretch is scanned

class ClusteredSample {
 public:
  /// Builds the sample from values in memory: values[i] belongs to the cluster with label cluster[i]. Throws
  /// Error for an empty or non-finite sample.
  ClusteredSample(std::span<const double> values, std::span<const uint64_t> cluster);
  /// Builds the sample from exact moments `sums` and approximate values, such as those of a histogram. Every
  /// label must have an entry in `sums`.
  ClusteredSample(const ClusterSums& sums, std::span<const double> values, std::span<const uint64_t> cluster);

  /// Number of clusters after joining, at most max_clusters.
  size_t n_clusters() const { return sums_.size(); }

  /// Return a statistic of the values of the clusters with these indices, which count in order of label and
  /// may be repeated.
  double mean(std::span<const size_t> clusters) const { return total(sums_, clusters).mean(); }
  double rmse(std::span<const size_t> clusters) const { return total(sums_, clusters).rmse(); }
  double quantile(std::span<const size_t> clusters, double p) const;
  void quantiles(std::span<const size_t> clusters, std::span<const double> ps, std::span<double> out) const;

 private:
  double quantile(std::span<const uint32_t> weight, double n, double p) const;
  /// Returns the number of values of the resample among the first `stretch` * stride_ sorted values.
  double count_below(std::span<const uint32_t> weight, size_t stretch) const;

  std::vector<Moments> sums_;     ///< by cluster
  std::vector<uint32_t> counts_;  ///< number of values, by cluster
  size_t stride_ = 1;
  std::vector<double> sorted_;   ///< all values, ascending
  std::vector<uint16_t> of_;     ///< cluster of each sorted value
  std::vector<uint32_t> below_;  ///< number of preceding values, by stretch and cluster
};

/// Statistics of a sample as tables show them, each with its interval by cluster bootstrap over the same
/// resamples.
struct SampleSummary {
  IntervalEstimate mean, rmse, q05, q25, median, q75, q95;
  size_t n_clusters = 0;  ///< with fewer than 2 there are no intervals
};
SampleSummary summarize_sample(const ClusteredSample& sample, const BootstrapOptions& options = {});

}  // namespace sextant
