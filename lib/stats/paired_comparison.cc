#include "sextant/stats/paired_comparison.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/stats/clustered_sample.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

/// Sums of a sample on both sides, at least `smallest` per case.
struct Totals {
  double base = 0, fresh = 0;
  double ratio() const { return fresh / base; }
};

Totals totals_of(const PairedSample& sample, double smallest) {
  Totals sum;
  for (const PairedCase& one : sample.cases) {
    sum.base += one.base;
    sum.fresh += one.fresh;
  }
  const double floor = smallest * static_cast<double>(sample.cases.size());
  return {std::max(sum.base, floor), std::max(sum.fresh, floor)};
}

struct Influence {
  size_t stratum = 0;
  uint64_t seed = 0;
  int frame = 0;
  double g = 0;
};

/// Variance of the sum of all influences of one stratum under one clustering, with its number of clusters.
struct StratumVariance {
  size_t stratum = 0;
  double n = 0;  ///< number of clusters
  double v = 0;  ///< 0 if n is 1
};

/// Returns the variance of each stratum. `key` returns the stratum and cluster of an influence; the function
/// sorts the influences by this key.
template <typename Key>
std::vector<StratumVariance> clustered_variance(std::vector<Influence>& influences, Key key) {
  std::ranges::sort(influences, {}, key);
  std::vector<StratumVariance> out;
  for (size_t i = 0; i < influences.size();) {
    StratumVariance stratum{influences[i].stratum};
    double sum = 0, squares = 0;
    while (i < influences.size() && influences[i].stratum == stratum.stratum) {
      double in_cluster = 0;
      const auto cluster = key(influences[i]);
      for (; i < influences.size() && key(influences[i]) == cluster; ++i) in_cluster += influences[i].g;
      stratum.n += 1;
      sum += in_cluster;
      squares += in_cluster * in_cluster;
    }
    if (stratum.n > 1)
      stratum.v = std::max(0.0, stratum.n / (stratum.n - 1) * (squares - sum * sum / stratum.n));
    out.push_back(stratum);
  }
  return out;
}

/// Returns the degrees of freedom after Satterthwaite; at most 1000, where Student's t is practically normal.
double degrees_of_freedom(const std::vector<StratumVariance>& strata) {
  double v = 0, squares = 0, n = 0;
  for (const StratumVariance& stratum : strata) {
    if (stratum.n < 2) continue;
    v += stratum.v;
    squares += stratum.v * stratum.v / (stratum.n - 1);
    n += stratum.n - 1;
  }
  return n == 0 ? 1000 : std::clamp(squares > 0 ? std::min(v * v / squares, n) : n, 1.0, 1000.0);
}

struct Spread {
  double error = 0;
  int dof = 1;
};

/// Returns the standard error of r and its degrees of freedom; nullopt if a stratum has only one cell.
std::optional<Spread> spread_of(std::vector<Influence>& influences) {
  const auto by_cell = clustered_variance(
      influences, [](const Influence& i) { return std::tuple(i.stratum, i.seed, i.frame); });
  const auto by_seed =
      clustered_variance(influences, [](const Influence& i) { return std::tuple(i.stratum, i.seed, 0); });
  const auto by_frame = clustered_variance(
      influences, [](const Influence& i) { return std::tuple(i.stratum, uint64_t{0}, i.frame); });
  double seeds = 0, frames = 0, both = 0;
  for (size_t k = 0; k < by_cell.size(); ++k) {
    if (by_cell[k].n < 2) return std::nullopt;
    const bool crossed = by_seed[k].n > 1 && by_frame[k].n > 1;
    seeds += by_seed[k].v;
    frames += by_frame[k].v;
    both += by_seed[k].v + by_frame[k].v - (crossed ? by_cell[k].v : 0);
  }
  const double variance = std::max({seeds, frames, both});
  // If all ratios are equal, only rounding error is left in the variance.
  return Spread{std::max(std::sqrt(variance), 1e-12),
                static_cast<int>(std::min(degrees_of_freedom(by_seed), degrees_of_freedom(by_frame)))};
}

/// Returns the p-value of the signed ranks; 1 if they point the other way than the mean.
double p_of_ranks(std::span<const double> values, double mean) {
  const WilcoxonTest test = wilcoxon_test(values);
  const double n = test.n_used;
  return (test.W - n * (n + 1) / 4) * mean < 0 ? 1 : test.p;
}

}  // namespace

RatioChange ratio_of_means(std::span<const PairedSample* const> samples, double smallest, double alpha) {
  constexpr double confidence = 0.95, power = 0.8;
  SEXTANT_CHECK(!samples.empty() && smallest > 0);
  double n = 0;
  for (const PairedSample* sample : samples) n += static_cast<double>(sample->cases.size());
  double r = 0, n_changed = 0;
  std::vector<Influence> influences;
  influences.reserve(static_cast<size_t>(n));
  for (const PairedSample* sample : samples) {
    const double weight = static_cast<double>(sample->cases.size()) / n;
    const Totals sum = totals_of(*sample, smallest);
    const double smaller = std::min(sum.base, sum.fresh);
    r += weight * (sum.ratio() - 1);
    for (const PairedCase& one : sample->cases) {
      n_changed += one.fresh != one.base ? 1 : 0;
      influences.push_back(
          {sample->stratum, one.seed, one.frame, weight * (one.fresh - sum.ratio() * one.base) / smaller});
    }
  }
  RatioChange out{.change = r, .interval = {}, .p = {}, .detectable = {}};
  const std::optional<Spread> spread = spread_of(influences);
  if (!spread) return out;
  const double smallest_p = std::min(1.0, std::exp2(1 - n_changed));
  out.p = std::clamp(2 * student_t_cdf(-std::abs(r) / spread->error, spread->dof), smallest_p, 1.0);
  const double t = student_t_quantile((1 + confidence) / 2, spread->dof) * spread->error;
  if (r >= 0) {
    out.interval = {r - t, r + t};
  } else if (t < 1) {
    out.interval = {(1 + r) / (1 + t) - 1, (1 + r) / (1 - t) - 1};
  }
  const double k = (student_t_quantile(1 - alpha / 2, spread->dof) + student_t_quantile(power, spread->dof)) *
                   spread->error;
  if (k < 1) out.detectable = k / (1 - k);
  return out;
}

PairedComparison compare_pairs(std::span<const double> differences, std::span<const uint64_t> cluster,
                               const BootstrapOptions& bootstrap) {
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
  out.p = p_of_ranks(means, out.difference);
  if (means.size() >= 2) out.detectable = minimum_detectable_effect(std_dev(means), out.n_clusters);
  return out;
}

}  // namespace sextant
