#pragma once

// A sample in clusters (bootstrap.h), prepared so that a statistic of a resample costs one walk over sums or
// over the sorted values: no copying, no sorting per replicate. Equal to the same statistic (summary.h) of
// the values of the chosen clusters, repetitions counted.

#include <cstdint>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"

namespace sextant {

class ClusteredSample {
 public:
  /// values[i] belongs to the cluster labelled cluster[i]. Throws Error for an empty or non-finite sample.
  ClusteredSample(std::span<const double> values, std::span<const uint64_t> cluster);

  size_t n_clusters() const { return sums_.size(); }

  /// Of the values of the clusters with these indices (by label), with repetition.
  double mean(std::span<const size_t> clusters) const;
  double rmse(std::span<const size_t> clusters) const;
  double quantile(std::span<const size_t> clusters, double p) const;  ///< type 7, as summary.h

 private:
  struct Sums {
    double n = 0, x = 0, xx = 0;
  };
  struct Value {
    double value;
    size_t cluster;
  };
  Sums total(std::span<const size_t> clusters) const;

  std::vector<Sums> sums_;     ///< by cluster
  std::vector<Value> sorted_;  ///< all values, rising
};

/// What a table says of a sample. Every number has its own cluster bootstrap over the same resamples.
struct SampleSummary {
  IntervalEstimate mean, rmse, q05, q25, median, q75, q95;
};
SampleSummary summarize_sample(const ClusteredSample& sample, const BootstrapOptions& options = {});

}  // namespace sextant
