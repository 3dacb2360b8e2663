#include "sextant/stats/trend.h"

#include <algorithm>
#include <cmath>
#include <functional>
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

// ---- Exact distribution of Page's statistic given the ranks of every block, with doubled midranks, which
// are integers.

using Ranks = std::vector<size_t>;

struct Distribution {
  size_t smallest = 0;                ///< smallest value
  std::vector<double> probabilities;  ///< of smallest, smallest + 1, ..
};

size_t page_statistic(const Ranks& ranks) {
  size_t sum = 0;
  for (size_t j = 0; j < ranks.size(); ++j) sum += (j + 1) * ranks[j];
  return sum;
}

/// Distribution of one block's statistic if all orders of its ranks are equally probable.
Distribution distribution_of_block(Ranks ranks) {
  std::ranges::sort(ranks, std::greater<>());
  Distribution out;
  out.smallest = page_statistic(ranks);
  std::ranges::reverse(ranks);
  out.probabilities.assign(page_statistic(ranks) - out.smallest + 1, 0.0);
  double n = 0;  // equal ranks are not exchanged: every distinct order stands for equally many permutations
  do {
    out.probabilities[page_statistic(ranks) - out.smallest] += 1;
    n += 1;
  } while (std::ranges::next_permutation(ranks).found);
  for (double& p : out.probabilities) p /= n;
  return out;
}

Distribution distribution_of_sum(const Distribution& a, const Distribution& b) {
  Distribution out{a.smallest + b.smallest,
                   std::vector<double>(a.probabilities.size() + b.probabilities.size() - 1)};
  for (size_t j = 0; j < b.probabilities.size(); ++j) {
    if (b.probabilities[j] == 0) continue;
    for (size_t i = 0; i < a.probabilities.size(); ++i)
      out.probabilities[i + j] += a.probabilities[i] * b.probabilities[j];
  }
  return out;
}

/// Returns true if the exact distribution takes less than a ms: about 10^6 products.
bool is_cheap(size_t n_levels, size_t n_blocks) {
  constexpr size_t most_levels = 6, most_values = 1420;
  const size_t values_of_block = n_levels * (n_levels * n_levels - 1) / 3 + 1;
  return n_levels <= most_levels && n_blocks * values_of_block <= most_values;
}

/// Returns the probability of a statistic of at least the observed one.
double exact_page_p(const std::vector<Ranks>& blocks) {
  std::map<Ranks, Distribution> of_block;  // by sorted ranks
  Distribution sum{0, {1.0}};
  size_t observed = 0;
  for (const Ranks& ranks : blocks) {
    observed += page_statistic(ranks);
    Ranks sorted = ranks;
    std::ranges::sort(sorted);
    const auto [found, is_new] = of_block.try_emplace(sorted);
    if (is_new) found->second = distribution_of_block(sorted);
    sum = distribution_of_sum(sum, found->second);
  }
  double p = 0;
  for (size_t i = sum.probabilities.size(); i-- > observed - sum.smallest;) p += sum.probabilities[i];
  return std::min(1.0, p);
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

double page_trend_test(const std::vector<std::vector<double>>& blocks) {
  if (blocks.empty() || blocks[0].size() < 2)
    fail("Page test: expected at least one block of at least 2 levels");
  const size_t k = blocks[0].size();
  const double centre = (static_cast<double>(k) + 1) / 2;
  double L = 0;
  double variance = 0;
  std::vector<Ranks> doubled;
  for (const std::vector<double>& block : blocks) {
    if (block.size() != k)
      fail("Page test: blocks of {} and {} levels: all blocks must have the same number of levels", k,
           block.size());
    check_sample(block, "Page test");
    const std::vector<double> ranks = midranks(block);
    double spread = 0;
    double spread_levels = 0;
    Ranks& doubled_ranks = doubled.emplace_back();
    for (size_t j = 0; j < k; ++j) {
      const auto position = static_cast<double>(j + 1);
      L += position * ranks[j];
      doubled_ranks.push_back(static_cast<size_t>(std::lround(2 * ranks[j])));
      spread += (ranks[j] - centre) * (ranks[j] - centre);
      spread_levels += (position - centre) * (position - centre);
    }
    variance += spread_levels * spread / (static_cast<double>(k) - 1);
  }
  const double expected = static_cast<double>(blocks.size()) * static_cast<double>(k) * centre * centre;
  if (is_cheap(k, blocks.size())) return exact_page_p(doubled);
  return variance > 0 ? normal_cdf(-((L - expected) / std::sqrt(variance))) : 1;
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
