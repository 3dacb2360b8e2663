#pragma once

// A sample in clusters (bootstrap.h), prepared so that a statistic of a resample costs one walk over the sums of its
// clusters: no copying, no sorting per replicate. Equal to the same statistic (summary.h) of the values of the chosen
// clusters, repetitions counted.
//
//   mean, rmse   from the clusters' sums (cluster_sums.h)
//   quantile     type 7. Beside the sorted values stands, every `stride` of them, how many of each cluster are below: the
//                quantile's stretch is found from these counts, and only that one is walked through

#include <cstdint>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"
#include "sextant/stats/cluster_sums.h"

namespace sextant {

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
