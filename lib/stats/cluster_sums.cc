#include "sextant/stats/cluster_sums.h"

#include <algorithm>
#include <numeric>

#include "sextant/base/error.h"
#include "sextant/stats/summary.h"

namespace sextant {

ClusterSums cluster_sums(std::span<const double> values, std::span<const uint64_t> cluster) {
  check_sample(values, "sums by cluster");
  SEXTANT_CHECK(values.size() == cluster.size());
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  if (!std::ranges::is_sorted(cluster))
    std::ranges::stable_sort(order, {}, [&](size_t i) { return cluster[i]; });
  ClusterSums sums;
  for (const size_t i : order) {
    if (sums.empty() || sums.back().label != cluster[i]) sums.push_back({cluster[i], {}});
    sums.back().of.add(values[i]);
  }
  return sums;
}

std::vector<Moments> joined_sums(const ClusterSums& clusters) {
  std::vector<Moments> joined(std::min(clusters.size(), max_clusters));
  for (size_t c = 0; c < clusters.size(); ++c) joined[joined_cluster(c, clusters.size())].add(clusters[c].of);
  return joined;
}

Moments total(std::span<const Moments> clusters, std::span<const size_t> chosen) {
  Moments sum;
  for (const size_t c : chosen) sum.add(clusters[c]);
  return sum;
}

Moments total(const ClusterSums& clusters) {
  Moments sum;
  for (const ClusterSum& cluster : clusters) sum.add(cluster.of);
  return sum;
}

}  // namespace sextant
