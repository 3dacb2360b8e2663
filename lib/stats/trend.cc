#include "sextant/stats/trend.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/stats/distributions.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

/// Sums of a cluster, from which the line through any collection of clusters follows.
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
      fail("noise slope: needs at least two levels, also in every resample: give each cluster all levels");
    }
    return (xy - x * y / n) / spread;
  }
};

LineSums total(const std::vector<LineSums>& clusters, std::span<const size_t> chosen) {
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

/// Sizes of the groups of equal values.
std::vector<double> tie_sizes(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::vector<double> sizes;
  for (auto begin = values.begin(); begin != values.end();) {
    const auto end = std::upper_bound(begin, values.end(), *begin);
    sizes.push_back(static_cast<double>(end - begin));
    begin = end;
  }
  return sizes;
}

struct TieSums {
  double a = 0;  ///< sum t (t-1) (2t+5)
  double b = 0;  ///< sum t (t-1) (t-2)
  double c = 0;  ///< sum t (t-1)
  explicit TieSums(const std::vector<double>& sizes) {
    for (const double t : sizes) {
      a += t * (t - 1) * (2 * t + 5);
      b += t * (t - 1) * (t - 2);
      c += t * (t - 1);
    }
  }
};

}  // namespace

NoiseSlope noise_slope(std::span<const double> level, std::span<const double> error,
                       std::span<const uint64_t> cluster, const BootstrapOptions& options) {
  SEXTANT_CHECK(level.size() == error.size() && level.size() == cluster.size());
  check_sample(level, "noise slope, levels", 2);
  check_sample(error, "noise slope, errors", 2);
  const double lowest = *std::min_element(level.begin(), level.end());
  std::vector<LineSums> clusters;
  LineSums all;
  for (const std::vector<size_t>& members : members_of_clusters(cluster)) {
    LineSums sums;
    for (const size_t i : members) {
      const double x = level[i] - lowest;
      const bool is_lowest = x == 0;
      sums.add({1, x, error[i], x * x, x * error[i], is_lowest ? 1.0 : 0.0, is_lowest ? error[i] : 0.0});
    }
    clusters.push_back(sums);
    all.add(sums);
  }
  NoiseSlope result;
  result.slope = all.slope();
  result.intercept = (all.y - result.slope * all.x) / all.n - result.slope * lowest;
  result.interval = cluster_bootstrap(
      clusters.size(), [&](std::span<const size_t> chosen) { return total(clusters, chosen).slope(); },
      options);
  const bool relative = all.y_lowest > 0 && std::all_of(clusters.begin(), clusters.end(),
                                                        [](const auto& sums) { return sums.y_lowest > 0; });
  if (all.y_lowest > 0) result.relative_slope = result.slope / (all.y_lowest / all.n_lowest);
  if (!relative) return result;  // a resample might have nothing to divide by
  result.relative_interval = cluster_bootstrap(
      clusters.size(),
      [&](std::span<const size_t> chosen) {
        const LineSums sums = total(clusters, chosen);
        return sums.slope() / (sums.y_lowest / sums.n_lowest);
      },
      options);
  return result;
}

TrendTest page_trend_test(const std::vector<std::vector<double>>& blocks) {
  if (blocks.empty() || blocks[0].size() < 2) fail("Page test: needs a block of at least 2 levels");
  const size_t k = blocks[0].size();
  const double centre = (static_cast<double>(k) + 1) / 2;
  double L = 0;
  double variance = 0;
  for (const std::vector<double>& block : blocks) {
    if (block.size() != k)
      fail("Page test: blocks of {} and of {} levels: all must have the same", k, block.size());
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

TrendTest jonckheere_test(const std::vector<std::vector<double>>& groups) {
  if (groups.size() < 2) fail("Jonckheere test: needs at least 2 groups, got {}", groups.size());
  std::vector<double> all, sizes;
  for (const std::vector<double>& group : groups) {
    check_sample(group, "Jonckheere test");
    all.insert(all.end(), group.begin(), group.end());
    sizes.push_back(static_cast<double>(group.size()));
  }
  double J = 0;
  for (size_t i = 0; i < groups.size(); ++i) {
    for (size_t j = i + 1; j < groups.size(); ++j) {
      for (const double x : groups[i]) {
        for (const double y : groups[j]) J += x < y ? 1 : x == y ? 0.5 : 0;
      }
    }
  }
  const auto N = static_cast<double>(all.size());
  double squares = 0;
  for (const double n : sizes) squares += n * n;
  const TieSums group(sizes);
  const TieSums tie(tie_sizes(all));
  double variance = (N * (N - 1) * (2 * N + 5) - group.a - tie.a) / 72;
  if (N > 2) variance += group.b * tie.b / (36 * N * (N - 1) * (N - 2));
  variance += group.c * tie.c / (8 * N * (N - 1));
  return normal_test(J, (N * N - squares) / 4, variance);
}

double minimum_detectable_effect(double sigma, int n, double alpha, double power) {
  if (!(sigma >= 0) || !std::isfinite(sigma))
    fail("minimum detectable effect: sigma = {}: must be >= 0", sigma);
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
