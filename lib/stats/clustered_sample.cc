#include "sextant/stats/clustered_sample.h"

#include <algorithm>
#include <cmath>

#include "sextant/stats/summary.h"

namespace sextant {

ClusteredSample::ClusteredSample(std::span<const double> values, std::span<const uint64_t> cluster) {
  check_sample(values, "clustered sample");
  SEXTANT_CHECK(values.size() == cluster.size());
  const std::vector<std::vector<size_t>> members = members_of_clusters(cluster);
  sorted_.reserve(values.size());
  for (size_t c = 0; c < members.size(); ++c) {
    Sums& sums = sums_.emplace_back();
    for (const size_t i : members[c]) {
      sums.n += 1;
      sums.x += values[i];
      sums.xx += values[i] * values[i];
      sorted_.push_back({values[i], c});
    }
  }
  std::stable_sort(sorted_.begin(), sorted_.end(),
                   [](const Value& a, const Value& b) { return a.value < b.value; });
}

ClusteredSample::Sums ClusteredSample::total(std::span<const size_t> clusters) const {
  Sums total;
  for (const size_t c : clusters) {
    total.n += sums_[c].n;
    total.x += sums_[c].x;
    total.xx += sums_[c].xx;
  }
  return total;
}

double ClusteredSample::mean(std::span<const size_t> clusters) const {
  const Sums sums = total(clusters);
  return sums.x / sums.n;
}

double ClusteredSample::rmse(std::span<const size_t> clusters) const {
  const Sums sums = total(clusters);
  return std::sqrt(sums.xx / sums.n);
}

double ClusteredSample::quantile(std::span<const size_t> clusters, double p) const {
  SEXTANT_CHECK(!clusters.empty() && p >= 0 && p <= 1);
  std::vector<double> weight(sums_.size());
  double n = 0;
  for (const size_t c : clusters) {
    weight[c] += 1;
    n += sums_[c].n;
  }
  const double position = (n - 1) * p;  // counted from 0
  const double below = std::floor(position);
  double seen = 0;
  double lower = 0;
  bool has_lower = false;
  for (const Value& v : sorted_) {
    seen += weight[v.cluster];
    if (!has_lower && seen > below) {
      lower = v.value;
      has_lower = true;
    }
    if (has_lower && (seen > below + 1 || seen == n)) return lower + (position - below) * (v.value - lower);
  }
  return lower;
}

SampleSummary summarize_sample(const ClusteredSample& sample, const BootstrapOptions& options) {
  const auto of = [&](const ClusterStatistic& statistic) {
    return cluster_estimate(sample.n_clusters(), statistic, options);
  };
  const auto quantile = [&](double p) {
    return of([&, p](std::span<const size_t> chosen) { return sample.quantile(chosen, p); });
  };
  return {.mean = of([&](std::span<const size_t> chosen) { return sample.mean(chosen); }),
          .rmse = of([&](std::span<const size_t> chosen) { return sample.rmse(chosen); }),
          .q05 = quantile(0.05),
          .q25 = quantile(0.25),
          .median = quantile(0.5),
          .q75 = quantile(0.75),
          .q95 = quantile(0.95)};
}

}  // namespace sextant
