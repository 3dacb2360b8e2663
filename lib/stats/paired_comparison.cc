#include "sextant/stats/paired_comparison.h"

#include <algorithm>
#include <numeric>

#include "sextant/stats/cluster_sums.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {

PairedComparison compare_pairs(std::span<const double> differences, std::span<const uint64_t> cluster,
                               const BootstrapOptions& bootstrap, PairedTest test) {
  SEXTANT_CHECK(cluster.empty() || cluster.size() == differences.size());
  std::vector<uint64_t> own(cluster.empty() ? differences.size() : 0);
  std::iota(own.begin(), own.end(), uint64_t{0});
  const std::span<const uint64_t> labels = cluster.empty() ? std::span<const uint64_t>(own) : cluster;
  const ClusterSums sums = cluster_sums(differences, labels);
  const std::vector<Moments> clusters = joined_sums(sums);
  const auto mean_of = [&](std::span<const size_t> chosen) { return total(clusters, chosen).mean(); };
  PairedComparison out;
  out.difference = mean(differences);
  out.interval = cluster_bootstrap(clusters.size(), mean_of, bootstrap);
  std::vector<double> means;
  for (const ClusterSum& sum : sums) means.push_back(sum.of.mean());
  out.n_clusters = static_cast<int>(means.size());
  out.n_used = out.n_clusters - static_cast<int>(std::ranges::count(means, 0.0));
  out.p = test == PairedTest::signed_ranks ? wilcoxon_test(means).p : sign_flip_test(means).p;
  if (means.size() >= 2) out.detectable = minimum_detectable_effect(std_dev(means), out.n_clusters);
  return out;
}

}  // namespace sextant
