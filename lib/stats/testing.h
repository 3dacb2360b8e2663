#pragma once

// The bootstrap of any statistic of values in clusters, computed literally: the reference of the statistics
// that work on sums of clusters.

#include <map>

#include "sextant/base/error.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Returns the indices of the values of each cluster, with the clusters in order of their labels.
inline std::vector<std::vector<size_t>> members_of_clusters(std::span<const uint64_t> cluster) {
  std::map<uint64_t, std::vector<size_t>> by_label;
  for (size_t i = 0; i < cluster.size(); ++i) by_label[cluster[i]].push_back(i);
  std::vector<std::vector<size_t>> members;
  for (auto& [label, indices] : by_label) members.push_back(std::move(indices));
  return members;
}

/// Returns the interval of a statistic of values in clusters: values[i] belongs to the cluster with label
/// cluster[i]. The statistic is evaluated on all values of the resampled clusters.
inline std::optional<Interval> bootstrap_by_cluster(std::span<const double> values,
                                                    std::span<const uint64_t> cluster,
                                                    const Statistic& statistic,
                                                    const BootstrapOptions& options = {}) {
  SEXTANT_CHECK(values.size() == cluster.size());
  const std::vector<std::vector<size_t>> members = members_of_clusters(cluster);
  std::vector<double> sample;
  const auto of_clusters = [&](std::span<const size_t> clusters) {
    sample.clear();
    for (const size_t c : clusters) {
      for (const size_t i : members[c]) sample.push_back(values[i]);
    }
    return statistic(sample);
  };
  return cluster_bootstrap(members.size(), of_clusters, options);
}

}  // namespace sextant
