#include "sextant/stats/trend.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

/// Sums over a cluster, from which the least-squares line through any set of clusters follows.
struct LineSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  double n_lowest = 0, y_lowest = 0;  ///< at the lowest level

  void add(const LineSums& o) {
    n += o.n;
    x += o.x;
    y += o.y;
    xx += o.xx;
    xy += o.xy;
    n_lowest += o.n_lowest;
    y_lowest += o.y_lowest;
  }
  double slope() const {
    const double spread = xx - x * x / n;
    if (!(spread > 1e-12 * xx)) {
      fail(
          "noise slope: needs at least two levels, also in every resample: give each cluster errors at all "
          "levels");
    }
    return (xy - x * y / n) / spread;
  }
};

LineSums total_of_lines(const std::vector<LineSums>& clusters, std::span<const size_t> chosen) {
  LineSums sum;
  for (const size_t c : chosen) sum.add(clusters[c]);
  return sum;
}

TrendTest normal_test(double statistic, double expected, double variance) {
  TrendTest test;
  test.statistic = statistic;
  if (variance > 0) {
    test.z = (statistic - expected) / std::sqrt(variance);
    test.p = normal_cdf(-test.z);
  }
  return test;
}

}  // namespace

NoiseSlope noise_slope(std::span<const LevelSums> levels, const BootstrapOptions& options) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const LevelSums& at : levels) lowest = std::min(lowest, at.level);
  std::map<uint64_t, LineSums> by_label;
  for (const LevelSums& at : levels) {
    const double x = at.level - lowest;
    for (const auto& [label, of] : at.clusters) {
      const bool is_lowest = x == 0;
      if (!std::isfinite(at.level) || !std::isfinite(of.x))
        fail("noise slope: level {}, sum of errors {}: expected finite numbers", at.level, of.x);
      by_label[label].add(
          {of.n, of.n * x, of.x, of.n * x * x, x * of.x, is_lowest ? of.n : 0.0, is_lowest ? of.x : 0.0});
    }
  }
  if (by_label.empty()) fail("noise slope: needs at least two levels, got no values");
  std::vector<LineSums> clusters(std::min(by_label.size(), max_clusters));
  LineSums all;
  for (size_t index = 0; const auto& [label, sums] : by_label) {
    clusters[joined_cluster(index++, by_label.size())].add(sums);
    all.add(sums);
  }
  NoiseSlope result;
  result.slope = all.slope();
  result.intercept = (all.y - result.slope * all.x) / all.n - result.slope * lowest;
  const bool relative = all.y_lowest > 0 && std::all_of(clusters.begin(), clusters.end(),
                                                        [](const auto& sums) { return sums.y_lowest > 0; });
  if (all.y_lowest > 0) result.relative_slope = result.slope / (all.y_lowest / all.n_lowest);
  const auto slopes = [&](std::span<const size_t> chosen, std::span<double> out) {
    const LineSums sums = total_of_lines(clusters, chosen);
    out[0] = sums.slope();
    if (out.size() > 1) out[1] = out[0] / (sums.y_lowest / sums.n_lowest);
  };
  // The interval of the relative slope is left out if a resample might divide by zero.
  const auto intervals = cluster_bootstrap(clusters.size(), relative ? 2 : 1, slopes, options);
  result.interval = intervals[0];
  if (relative) result.relative_interval = intervals[1];
  return result;
}

TrendTest page_trend_test(const std::vector<std::vector<double>>& blocks) {
  if (blocks.empty() || blocks[0].size() < 2)
    fail("Page test: expected at least one block of at least 2 levels");
  const size_t k = blocks[0].size();
  const double centre = (static_cast<double>(k) + 1) / 2;
  double L = 0;
  double variance = 0;
  for (const std::vector<double>& block : blocks) {
    if (block.size() != k)
      fail("Page test: blocks of {} and {} levels: all blocks must have the same number of levels", k,
           block.size());
    check_sample(block, "Page test");
    const std::vector<double> ranks = midranks(block);
    double spread = 0;
    double spread_levels = 0;
    for (size_t j = 0; j < k; ++j) {
      const auto position = static_cast<double>(j + 1);
      L += position * ranks[j];
      spread += (ranks[j] - centre) * (ranks[j] - centre);
      spread_levels += (position - centre) * (position - centre);
    }
    variance += spread_levels * spread / (static_cast<double>(k) - 1);
  }
  const double expected = static_cast<double>(blocks.size()) * static_cast<double>(k) * centre * centre;
  return normal_test(L, expected, variance);
}

double minimum_detectable_effect(double sigma, int n, double alpha, double power) {
  if (!(sigma >= 0) || !std::isfinite(sigma))
    fail("minimum detectable effect: sigma = {}: must be finite and >= 0", sigma);
  if (n < 2) fail("minimum detectable effect: n = {}: must be >= 2", n);
  return (normal_quantile(1 - alpha / 2) + normal_quantile(power)) * sigma / std::sqrt(n);
}

Interval nees_interval(int n, int dof, double confidence) {
  if (n < 1 || dof < 1) fail("NEES interval: n = {}, dof = {}: both must be >= 1", n, dof);
  const double tail = (1 - confidence) / 2;
  const double total = static_cast<double>(n) * dof;
  return {chi_square_quantile(tail, total) / n, chi_square_quantile(1 - tail, total) / n};
}

}  // namespace sextant
