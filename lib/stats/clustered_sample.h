#pragma once

// Sums by cluster (bootstrap.h): all that means, RMS values and slopes need of a sample, whether its values
// are at hand or were added up elsewhere.
//
//   n, sum x, sum x^2   of each cluster, clusters in order of their labels
//
// Intervals of more than max_clusters clusters are those of that many groups of neighbouring labels, as equal
// as can be: an interval from 2000 groups has a relative error of 1 / sqrt(2 * 2000) = 1.6 %, as it has from
// 2000 replicates, and costs no more for a million seeds than for 2000.

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
/// In order of label, each once.
using ClusterSums = std::vector<ClusterSum>;

/// values[i] belongs to the cluster labelled cluster[i]. Throws Error for an empty or non-finite sample.
ClusterSums cluster_sums(std::span<const double> values, std::span<const uint64_t> cluster);

constexpr size_t max_clusters = 2000;
/// The group of the cluster with this index.
constexpr size_t joined_cluster(size_t index, size_t n_clusters) {
  return n_clusters <= max_clusters ? index : index * max_clusters / n_clusters;
}
/// By group.
std::vector<Moments> joined_sums(const ClusterSums& clusters);

/// Of the clusters with these indices, in this order, repetitions counted.
Moments total(std::span<const Moments> clusters, std::span<const size_t> chosen);
Moments total(const ClusterSums& clusters);

// A sample in clusters (bootstrap.h), prepared so that a statistic of a resample costs one walk over the sums
// of its clusters: no copying, no sorting per replicate. Equal to the same statistic (summary.h) of the
// values of the chosen clusters, repetitions counted.
//
//   mean, rmse   from the clusters' sums (clustered_sample.h)
//   quantile     type 7. Beside the sorted values stands, every `stride` of them, how many of each cluster
//                are below: the quantile's stretch is found from these counts, and only that one is walked
//                through

class ClusteredSample {
 public:
  /// values[i] belongs to the cluster labelled cluster[i]. Throws Error for an empty or non-finite sample.
  ClusteredSample(std::span<const double> values, std::span<const uint64_t> cluster);
  /// With sums that are exact where the values are not, such as those of a histogram. Every label has a sum.
  ClusteredSample(const ClusterSums& sums, std::span<const double> values, std::span<const uint64_t> cluster);

  /// At most max_clusters: of more they are joined.
  size_t n_clusters() const { return sums_.size(); }

  /// Of the values of the clusters with these indices (by label), with repetition.
  double mean(std::span<const size_t> clusters) const { return total(sums_, clusters).mean(); }
  double rmse(std::span<const size_t> clusters) const { return total(sums_, clusters).rmse(); }
  double quantile(std::span<const size_t> clusters, double p) const;
  void quantiles(std::span<const size_t> clusters, std::span<const double> ps, std::span<double> out) const;

 private:
  double quantile(std::span<const uint32_t> weight, double n, double p) const;
  /// How many of the first `stretch` * stride_ values there are.
  double count_below(std::span<const uint32_t> weight, size_t stretch) const;

  std::vector<Moments> sums_;     ///< by cluster
  std::vector<uint32_t> counts_;  ///< of values, by cluster
  size_t stride_ = 1;
  std::vector<double> sorted_;   ///< all values, rising
  std::vector<uint16_t> of_;     ///< the cluster of each
  std::vector<uint32_t> below_;  ///< by stretch and cluster
};

/// What a table says of a sample. Every number has its own cluster bootstrap over the same resamples.
struct SampleSummary {
  IntervalEstimate mean, rmse, q05, q25, median, q75, q95;
};
SampleSummary summarize_sample(const ClusteredSample& sample, const BootstrapOptions& options = {});

}  // namespace sextant
