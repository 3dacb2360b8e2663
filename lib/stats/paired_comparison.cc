#include "sextant/stats/paired_comparison.h"

#include <algorithm>
#include <numeric>

#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {

PairedComparison compare_pairs(std::span<const double> differences, std::span<const uint64_t> cluster,
                               const BootstrapOptions& bootstrap, PairedTest test) {
  SEXTANT_CHECK(cluster.empty() || cluster.size() == differences.size());
  std::vector<uint64_t> own(cluster.empty() ? differences.size() : 0);
  std::iota(own.begin(), own.end(), uint64_t{0});
  const std::span<const uint64_t> labels = cluster.empty() ? std::span<const uint64_t>(own) : cluster;
  const std::vector<std::vector<size_t>> members = members_of_clusters(labels);
  const auto mean_of = [&](std::span<const size_t> chosen) {
    double sum = 0, n = 0;
    for (const size_t c : chosen) {
      for (const size_t i : members[c]) sum += differences[i];
      n += static_cast<double>(members[c].size());
    }
    return sum / n;
  };
  PairedComparison out;
  out.difference = mean(differences);
  out.interval = cluster_bootstrap(members.size(), mean_of, bootstrap);
  const std::vector<double> means = cluster_means(differences, labels);
  out.n_clusters = static_cast<int>(means.size());
  out.n_used = out.n_clusters - static_cast<int>(std::ranges::count(means, 0.0));
  out.p = test == PairedTest::signed_ranks ? wilcoxon_test(means).p : sign_flip_test(means).p;
  if (means.size() >= 2) out.detectable = minimum_detectable_effect(std_dev(means), out.n_clusters);
  return out;
}

std::vector<double> cluster_means(std::span<const double> values, std::span<const uint64_t> cluster) {
  std::vector<double> means;
  for (const std::vector<size_t>& members : members_of_clusters(cluster)) {
    double sum = 0;
    for (const size_t i : members) sum += values[i];
    means.push_back(sum / static_cast<double>(members.size()));
  }
  return means;
}

}  // namespace sextant
