#include "sextant/stats/clustered_sample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/simd.h"
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

namespace {

static_assert(max_clusters <= std::numeric_limits<uint16_t>::max());
constexpr size_t min_stride = 512;
constexpr size_t max_stretches = 1024;

SEXTANT_SIMD uint64_t weighted_sum(const uint32_t* weight, const uint32_t* count, size_t n) {
  uint64_t sum = 0;
  for (size_t i = 0; i < n; ++i) sum += uint64_t{weight[i]} * count[i];
  return sum;
}

}  // namespace

ClusteredSample::ClusteredSample(std::span<const double> values, std::span<const uint64_t> cluster)
    : ClusteredSample(cluster_sums(values, cluster), values, cluster) {}

ClusteredSample::ClusteredSample(const ClusterSums& sums, std::span<const double> values,
                                 std::span<const uint64_t> cluster)
    : sums_(joined_sums(sums)) {
  check_sample(values, "clustered sample");
  SEXTANT_CHECK(values.size() == cluster.size());
  std::vector<std::pair<double, uint16_t>> rising;
  rising.reserve(values.size());
  for (size_t i = 0, at = 0; i < cluster.size(); ++i) {
    if (at >= sums.size() || sums[at].label != cluster[i]) {
      const auto known = std::ranges::lower_bound(sums, cluster[i], {}, &ClusterSum::label);
      SEXTANT_CHECK(known != sums.end() && known->label == cluster[i]);
      at = static_cast<size_t>(known - sums.begin());
    }
    rising.emplace_back(values[i], static_cast<uint16_t>(joined_cluster(at, sums.size())));
  }
  std::ranges::sort(rising);
  counts_.resize(sums_.size());
  stride_ = std::max(min_stride, values.size() / max_stretches);
  sorted_.reserve(rising.size());
  of_.reserve(rising.size());
  for (const auto& [value, group] : rising) {
    if (sorted_.size() % stride_ == 0) below_.insert(below_.end(), counts_.begin(), counts_.end());
    sorted_.push_back(value);
    of_.push_back(group);
    ++counts_[group];
  }
}

double ClusteredSample::count_below(std::span<const uint32_t> weight, size_t stretch) const {
  return static_cast<double>(weighted_sum(weight.data(), &below_[stretch * weight.size()], weight.size()));
}

double ClusteredSample::quantile(std::span<const uint32_t> weight, double n, double p) const {
  SEXTANT_CHECK(p >= 0 && p <= 1);
  const double position = (n - 1) * p;  // 0-based
  const double below = std::floor(position);
  // The last stretch that begins at or before the quantile; the search starts at the stretch of the whole
  // sample's quantile.
  const size_t last = (sorted_.size() - 1) / stride_;
  auto stretch = static_cast<size_t>(p * static_cast<double>(last));
  double seen = count_below(weight, stretch);
  while (seen > below) seen = count_below(weight, --stretch);
  for (double next = 0; stretch < last && (next = count_below(weight, stretch + 1)) <= below; ++stretch)
    seen = next;
  double lower = 0;
  bool has_lower = false;
  for (size_t i = stretch * stride_; i < sorted_.size(); ++i) {
    seen += weight[of_[i]];
    if (!has_lower && seen > below) {
      lower = sorted_[i];
      has_lower = true;
    }
    if (has_lower && (seen > below + 1 || seen == n))
      return lower + (position - below) * (sorted_[i] - lower);
  }
  return lower;
}

void ClusteredSample::quantiles(std::span<const size_t> clusters, std::span<const double> ps,
                                std::span<double> out) const {
  SEXTANT_CHECK(!clusters.empty() && ps.size() == out.size());
  std::vector<uint32_t> weight(counts_.size());
  double n = 0;
  for (const size_t c : clusters) {
    ++weight[c];
    n += counts_[c];
  }
  for (size_t i = 0; i < ps.size(); ++i) out[i] = quantile(weight, n, ps[i]);
}

double ClusteredSample::quantile(std::span<const size_t> clusters, double p) const {
  double value = 0;
  quantiles(clusters, {&p, 1}, {&value, 1});
  return value;
}

SampleSummary summarize_sample(const ClusteredSample& sample, const BootstrapOptions& options) {
  constexpr std::array<double, 5> ps = {0.05, 0.25, 0.5, 0.75, 0.95};
  const auto all = [&](std::span<const size_t> chosen, std::span<double> out) {
    out[0] = sample.mean(chosen);
    out[1] = sample.rmse(chosen);
    sample.quantiles(chosen, ps, out.subspan(2));
  };
  const std::vector<IntervalEstimate> e = cluster_estimates(sample.n_clusters(), 2 + ps.size(), all, options);
  return {.mean = e[0],
          .rmse = e[1],
          .q05 = e[2],
          .q25 = e[3],
          .median = e[4],
          .q75 = e[5],
          .q95 = e[6],
          .n_clusters = sample.n_clusters()};
}

}  // namespace sextant
