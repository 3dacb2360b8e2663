#include "sextant/stats/bootstrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <tuple>

#include "sextant/base/philox.h"
#include "sextant/stats/clustered_sample.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

/// Cluster indices of each resample. For up to max_clusters clusters they are drawn once and cached per
/// thread with 2 bytes each, because a report asks for the same resamples hundreds of times.
class Draws {
 public:
  Draws(size_t n_clusters, const BootstrapOptions& options) : n_clusters_(n_clusters), seed_(options.seed) {
    if (n_clusters > max_clusters) return;
    static thread_local std::tuple<size_t, int, uint64_t> kept_for;
    static thread_local std::shared_ptr<const std::vector<uint16_t>> kept;
    const std::tuple wanted(n_clusters, options.replicates, options.seed);
    if (kept == nullptr || kept_for != wanted) {
      kept = std::make_shared<const std::vector<uint16_t>>(draw(options.replicates));
      kept_for = wanted;
    }
    kept_ = kept;
  }

  void resample(int r, std::span<size_t> chosen) const {
    if (kept_ != nullptr) {
      std::ranges::copy(std::span(*kept_).subspan(static_cast<size_t>(r) * n_clusters_, n_clusters_),
                        chosen.begin());
      return;
    }
    PhiloxStream random(seed_, static_cast<uint64_t>(r));
    for (size_t& index : chosen) index = random.below(n_clusters_);
  }

 private:
  std::vector<uint16_t> draw(int replicates) const {
    static_assert(max_clusters <= std::numeric_limits<uint16_t>::max());
    std::vector<uint16_t> drawn;
    drawn.reserve(static_cast<size_t>(replicates) * n_clusters_);
    for (int r = 0; r < replicates; ++r) {
      PhiloxStream random(seed_, static_cast<uint64_t>(r));
      for (size_t i = 0; i < n_clusters_; ++i)
        drawn.push_back(static_cast<uint16_t>(random.below(n_clusters_)));
    }
    return drawn;
  }

  size_t n_clusters_;
  uint64_t seed_;
  std::shared_ptr<const std::vector<uint16_t>> kept_;
};

/// Matrix of statistics: one row per resample, one column per statistic.
class Resamples {
 public:
  Resamples(size_t n_statistics, const ClusterStatistics& statistics)
      : columns_(n_statistics), row_(n_statistics), statistics_(statistics) {}

  void add(std::span<const size_t> clusters) {
    statistics_(clusters, row_);
    for (size_t s = 0; s < row_.size(); ++s) {
      if (!std::isfinite(row_[s]))
        fail("bootstrap: the statistic of a resample is {}, expected a finite number", row_[s]);
      columns_[s].push_back(row_[s]);
    }
  }
  std::vector<double>& column(size_t statistic) { return columns_[statistic]; }

 private:
  std::vector<std::vector<double>> columns_;
  std::vector<double> row_;
  const ClusterStatistics& statistics_;
};

std::vector<size_t> all_of(size_t n_clusters) {
  std::vector<size_t> all(n_clusters);
  std::iota(all.begin(), all.end(), size_t{0});
  return all;
}

/// Returns the statistics with each cluster left out in turn.
Resamples jackknife(size_t n_clusters, size_t n_statistics, const ClusterStatistics& statistics) {
  Resamples left_out(n_statistics, statistics);
  std::vector<size_t> rest = all_of(n_clusters);
  rest.erase(rest.begin());
  for (size_t skip = 0; skip < n_clusters; ++skip) {
    left_out.add(rest);
    if (skip + 1 < n_clusters) rest[skip] = skip;
  }
  return left_out;
}

/// Returns the skewness of the jackknife values, divided by 6.
double acceleration(const std::vector<double>& left_out) {
  const double centre = mean(left_out);
  double squares = 0;
  double cubes = 0;
  for (const double value : left_out) {
    const double d = centre - value;
    squares += d * d;
    cubes += d * d * d;
  }
  return squares > 0 ? cubes / (6 * std::pow(squares, 1.5)) : 0;
}

/// Returns z0, the normal quantile of the share of replicates below the estimate, with ties counted half;
/// clamped half a replicate away from 0 and 1. Differences within rounding count as ties, so that the order
/// of a sum has no influence.
double bias(const std::vector<double>& sorted, double estimate) {
  const double rounding = 1e-12 * std::max(std::abs(sorted.front()), std::abs(sorted.back()));
  const auto first = std::lower_bound(sorted.begin(), sorted.end(), estimate - rounding);
  const auto last = std::upper_bound(first, sorted.end(), estimate + rounding);
  const auto n = static_cast<double>(sorted.size());
  const double below = static_cast<double>(first - sorted.begin()) + 0.5 * static_cast<double>(last - first);
  return normal_quantile(std::clamp(below, 0.5, n - 0.5) / n);
}

}  // namespace

void BootstrapOptions::check() const {
  check_option(replicates >= 100, "bootstrap.replicates", replicates, ">= 100");
  check_option(confidence > 0 && confidence < 1, "bootstrap.confidence", confidence, "above 0 and below 1");
}

std::vector<std::optional<Interval>> cluster_bootstrap(size_t n_clusters, size_t n_statistics,
                                                       const ClusterStatistics& statistics,
                                                       const BootstrapOptions& options) {
  options.check();
  std::vector<std::optional<Interval>> intervals(n_statistics);
  if (n_clusters < 2) return intervals;
  Resamples drawn(n_statistics, statistics);
  const Draws draws(n_clusters, options);
  std::vector<size_t> chosen(n_clusters);
  for (int r = 0; r < options.replicates; ++r) {
    draws.resample(r, chosen);
    drawn.add(chosen);
  }
  const auto n = static_cast<double>(n_clusters);
  const double tail =
      normal_cdf(std::sqrt(n / (n - 1)) *  // alpha' in the header
                 student_t_quantile((1 - options.confidence) / 2, static_cast<int>(n_clusters - 1)));
  const bool bca = options.method == BootstrapMethod::bca;
  Resamples estimate(n_statistics, statistics);
  if (bca) estimate.add(all_of(n_clusters));
  Resamples left_out = bca ? jackknife(n_clusters, n_statistics, statistics) : Resamples(0, statistics);
  for (size_t s = 0; s < n_statistics; ++s) {
    std::vector<double>& replicates = drawn.column(s);
    std::sort(replicates.begin(), replicates.end());
    if (!bca) {
      intervals[s] = {quantile_of_sorted(replicates, tail), quantile_of_sorted(replicates, 1 - tail)};
      continue;
    }
    const double z0 = bias(replicates, estimate.column(s).front());
    const double a = acceleration(left_out.column(s));
    const auto level = [&](double z) {
      const double denominator = 1 - a * (z0 + z);
      if (denominator <= 0) return z0 + z > 0 ? 1.0 : 0.0;  // outside the range of the replicates
      return normal_cdf(z0 + (z0 + z) / denominator);
    };
    const double z = -normal_quantile(std::max(tail, 1e-12));
    intervals[s] = {quantile_of_sorted(replicates, level(-z)), quantile_of_sorted(replicates, level(z))};
  }
  return intervals;
}

std::optional<Interval> cluster_bootstrap(size_t n_clusters, const ClusterStatistic& statistic,
                                          const BootstrapOptions& options) {
  const auto one = [&](std::span<const size_t> clusters, std::span<double> out) {
    out[0] = statistic(clusters);
  };
  return cluster_bootstrap(n_clusters, 1, one, options).front();
}

std::vector<IntervalEstimate> cluster_estimates(size_t n_clusters, size_t n_statistics,
                                                const ClusterStatistics& statistics,
                                                const BootstrapOptions& options) {
  std::vector<double> values(n_statistics);
  statistics(all_of(n_clusters), values);
  const std::vector<std::optional<Interval>> intervals =
      cluster_bootstrap(n_clusters, n_statistics, statistics, options);
  std::vector<IntervalEstimate> estimates;
  for (size_t s = 0; s < n_statistics; ++s) estimates.push_back({values[s], intervals[s]});
  return estimates;
}

IntervalEstimate cluster_estimate(size_t n_clusters, const ClusterStatistic& statistic,
                                  const BootstrapOptions& options) {
  return {statistic(all_of(n_clusters)), cluster_bootstrap(n_clusters, statistic, options)};
}

std::optional<Interval> bootstrap(std::span<const double> values, const Statistic& statistic,
                                  const BootstrapOptions& options) {
  check_sample(values, "bootstrap");
  std::vector<double> sample(values.size());
  const auto of_values = [&](std::span<const size_t> chosen) {
    sample.clear();
    for (const size_t i : chosen) sample.push_back(values[i]);
    return statistic(sample);
  };
  return cluster_bootstrap(values.size(), of_values, options);
}

}  // namespace sextant
