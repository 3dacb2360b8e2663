#pragma once

// Sums by cluster (bootstrap.h): all that means, RMS values and slopes need of a sample, whether its values are at hand or
// were added up elsewhere.
//
//   n, sum x, sum x^2   of each cluster, clusters in order of their labels
//
// Intervals of more than max_clusters clusters are those of that many groups of neighbouring labels, as equal as can be: an
// interval from 2000 groups has a relative error of 1 / sqrt(2 * 2000) = 1.6 %, as it has from 2000 replicates, and costs no
// more for a million seeds than for 2000.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

}  // namespace sextant
