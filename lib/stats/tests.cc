#include "sextant/stats/tests.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sextant/base/error.h"
#include "sextant/base/philox.h"
#include "sextant/stats/distributions.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr size_t max_exact_flips = 16;
constexpr size_t max_exact_wilcoxon = 50;
constexpr size_t max_exact_mann_whitney = 40;

/// Midranks are multiples of 1/2; doubled, they are integers, for which exact distributions can be counted.
std::vector<size_t> doubled(const std::vector<double>& ranks) {
  std::vector<size_t> out;
  for (const double rank : ranks) out.push_back(static_cast<size_t>(std::lround(2 * rank)));
  return out;
}

/// Returns the two-sided p of value t of a discrete distribution with (unnormalised) weights of 0, 1, ..
double two_sided(const std::vector<double>& weights, size_t t) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double lower = std::accumulate(weights.begin(), weights.begin() + static_cast<long>(t) + 1, 0.0);
  const double upper = std::accumulate(weights.begin() + static_cast<long>(t), weights.end(), 0.0);
  return std::min(1.0, 2 * std::min(lower, upper) / total);
}

/// Returns the two-sided p of a normal statistic on a lattice of step 1, with continuity correction.
double two_sided_normal(double deviation, double variance) {
  if (!(variance > 0)) return 1;
  const double z = std::max(0.0, std::abs(deviation) - 0.5) / std::sqrt(variance);
  return std::min(1.0, 2 * normal_cdf(-z));
}

/// Returns sum t^3 - t over groups of t equal values.
double tie_term(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (auto begin = values.begin(); begin != values.end();) {
    const auto end = std::upper_bound(begin, values.end(), *begin);
    const auto t = static_cast<double>(end - begin);
    sum += t * t * t - t;
    begin = end;
  }
  return sum;
}

/// Returns, for each value s, the number of subsets whose doubled rank sum is s.
std::vector<double> subset_sums(const std::vector<size_t>& ranks) {
  std::vector<double> weights(std::accumulate(ranks.begin(), ranks.end(), size_t{0}) + 1, 0);
  weights[0] = 1;
  size_t largest = 0;
  for (const size_t rank : ranks) {
    largest += rank;
    for (size_t s = largest; s >= rank; --s) weights[s] += weights[s - rank];
  }
  return weights;
}

/// Returns, for each value s, the number of subsets of n members whose doubled rank sum is s.
std::vector<double> subset_sums_of_size(const std::vector<size_t>& ranks, size_t n) {
  const size_t largest = std::accumulate(ranks.begin(), ranks.end(), size_t{0});
  std::vector<std::vector<double>> weights(n + 1, std::vector<double>(largest + 1, 0));
  weights[0][0] = 1;
  for (const size_t rank : ranks) {
    for (size_t k = n; k >= 1; --k) {
      for (size_t s = largest; s >= rank; --s) weights[k][s] += weights[k - 1][s - rank];
    }
  }
  return weights[n];
}

/// Returns the largest k with P(U < k) <= tail for samples of m and n values without ties.
size_t values_of_u_below(size_t m, size_t n, double tail) {
  if (m + n > max_exact_mann_whitney) {
    const auto pairs = static_cast<double>(m * n);
    const double sigma = std::sqrt(pairs * static_cast<double>(m + n + 1) / 12);
    return static_cast<size_t>(std::max(0.0, pairs / 2 + normal_quantile(tail) * sigma));
  }
  std::vector<size_t> ranks(m + n);
  std::iota(ranks.begin(), ranks.end(), size_t{1});
  const std::vector<double> weights = subset_sums_of_size(ranks, m);  // distribution of U + m (m + 1) / 2
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  double below = 0;
  for (size_t k = 0; k <= m * n; ++k) {
    below += weights[k + m * (m + 1) / 2];
    if (below > tail * total) return k;
  }
  return m * n;
}

/// Returns the number of sign patterns among `n_patterns` whose |signed sum| is at least the observed one.
template <typename Signs>
double count_as_extreme(std::span<const double> values, size_t n_patterns, Signs sign_bits) {
  double observed = 0;
  double scale = 0;
  for (const double d : values) {
    observed += d;
    scale += std::abs(d);
  }
  const double threshold = std::abs(observed) - 1e-12 * scale;  // tolerates another order of summation
  double hits = 0;
  for (size_t pattern = 0; pattern < n_patterns; ++pattern) {
    double sum = 0;
    for (size_t i = 0; i < values.size(); ++i) sum += sign_bits(pattern, i) ? values[i] : -values[i];
    hits += std::abs(sum) >= threshold;
  }
  return hits;
}

}  // namespace

SignFlipTest sign_flip_test(std::span<const double> differences, int samples, uint64_t seed) {
  check_sample(differences, "sign-flip test");
  SignFlipTest test;
  test.mean_difference = mean(differences);
  const size_t n = differences.size();
  test.exact = n <= max_exact_flips;
  if (test.exact) {
    const size_t patterns = size_t{1} << n;
    const auto bit = [](size_t pattern, size_t i) { return (pattern >> i) & 1U; };
    test.p = count_as_extreme(differences, patterns, bit) / static_cast<double>(patterns);
    return test;
  }
  if (samples < 100) fail("sign-flip test: {} samples: must be >= 100", samples);
  PhiloxStream random(seed, 0);
  uint64_t bits = 0;
  const auto coin = [&](size_t, size_t i) {
    if (i % 64 == 0) bits = random.bits();
    return (bits >> (i % 64)) & 1U;
  };
  test.p = (1 + count_as_extreme(differences, static_cast<size_t>(samples), coin)) / (1.0 + samples);
  return test;
}

WilcoxonTest wilcoxon_test(std::span<const double> differences) {
  check_sample(differences, "Wilcoxon test");
  std::vector<double> magnitudes;
  std::vector<bool> positive;
  for (const double d : differences) {
    if (d == 0) continue;
    magnitudes.push_back(std::abs(d));
    positive.push_back(d > 0);
  }
  WilcoxonTest test{.n_used = static_cast<int>(magnitudes.size()),
                    .exact = magnitudes.size() <= max_exact_wilcoxon};
  if (magnitudes.empty()) return test;
  const std::vector<double> ranks = midranks(magnitudes);
  for (size_t i = 0; i < ranks.size(); ++i) test.W += positive[i] ? ranks[i] : 0;
  if (test.exact) {
    test.p = two_sided(subset_sums(doubled(ranks)), static_cast<size_t>(std::lround(2 * test.W)));
    return test;
  }
  const double n = test.n_used;
  const double variance = n * (n + 1) * (2 * n + 1) / 24 - tie_term(magnitudes) / 48;
  test.p = two_sided_normal(test.W - n * (n + 1) / 4, variance);
  return test;
}

MannWhitneyTest mann_whitney_test(std::span<const double> x, std::span<const double> y) {
  check_sample(x, "Mann-Whitney test, first sample");
  check_sample(y, "Mann-Whitney test, second sample");
  std::vector<double> all(x.begin(), x.end());
  all.insert(all.end(), y.begin(), y.end());
  const std::vector<double> ranks = midranks(all);
  const double rank_sum = std::accumulate(ranks.begin(), ranks.begin() + static_cast<long>(x.size()), 0.0);
  const auto m = static_cast<double>(x.size());
  const auto n = static_cast<double>(y.size());
  MannWhitneyTest test;
  test.U = rank_sum - m * (m + 1) / 2;
  test.cliffs_delta = 2 * test.U / (m * n) - 1;
  std::vector<double> shifts;
  for (const double a : x) {
    for (const double b : y) shifts.push_back(a - b);
  }
  test.hodges_lehmann_shift = median(shifts);
  test.exact = all.size() <= max_exact_mann_whitney;
  if (test.exact) {
    test.p = two_sided(subset_sums_of_size(doubled(ranks), x.size()),
                       static_cast<size_t>(std::lround(2 * rank_sum)));
    return test;
  }
  const double total = m + n;
  const double variance = m * n / 12 * (total + 1 - tie_term(all) / (total * (total - 1)));
  test.p = two_sided_normal(test.U - m * n / 2, variance);
  return test;
}

std::optional<Interval> hodges_lehmann_interval(std::span<const double> x, std::span<const double> y,
                                                double confidence) {
  check_sample(x, "Hodges-Lehmann interval, first sample");
  check_sample(y, "Hodges-Lehmann interval, second sample");
  if (!(confidence > 0 && confidence < 1)) fail("confidence = {}: must be in 0..1", confidence);
  std::vector<double> shifts;
  for (const double a : x) {
    for (const double b : y) shifts.push_back(a - b);
  }
  std::sort(shifts.begin(), shifts.end());
  const size_t n_out = values_of_u_below(x.size(), y.size(), (1 - confidence) / 2);
  if (n_out == 0) return std::nullopt;
  return Interval{shifts[n_out - 1], shifts[shifts.size() - n_out]};
}

std::vector<double> holm(std::span<const double> p) {
  for (const double value : p) {
    if (!(value >= 0 && value <= 1)) fail("correction for multiple tests: p = {}: must be in 0..1", value);
  }
  std::vector<size_t> order(p.size());  // ascending
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return p[i]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(p.size() - i) * p[order[i]]));
    adjusted[order[i]] = largest;
  }
  return adjusted;
}

namespace {

double noise_of(std::span<const double> values) {
  std::vector<double> steps;
  for (size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  return 1.4826 * mad(steps) / std::sqrt(2.0);
}

double deviations_from_median(const std::vector<double>& sorted) {
  const double middle = quantile_of_sorted(sorted, 0.5);
  double sum = 0;
  for (const double value : sorted) sum += std::abs(value - middle);
  return sum;
}

/// Joins adjacent segments whose medians differ by less than `min_step`, the most similar first.
void drop_small_steps(std::span<const double> values, double min_step, std::vector<size_t>& cuts) {
  while (!cuts.empty()) {
    std::vector<double> medians;
    for (size_t i = 0; i <= cuts.size(); ++i) {
      const size_t begin = i == 0 ? 0 : cuts[i - 1], end = i == cuts.size() ? values.size() : cuts[i];
      medians.push_back(median(values.subspan(begin, end - begin)));
    }
    size_t smallest = 0;
    const auto step = [&](size_t i) { return std::abs(medians[i + 1] - medians[i]); };
    for (size_t i = 1; i < cuts.size(); ++i) smallest = step(i) < step(smallest) ? i : smallest;
    if (step(smallest) >= min_step) return;
    cuts.erase(cuts.begin() + static_cast<std::ptrdiff_t>(smallest));
  }
}

}  // namespace

std::vector<size_t> change_points(std::span<const double> values, double min_step) {
  if (!(min_step >= 0)) fail("change points: smallest step {}: must be >= 0", min_step);
  if (values.size() < 2) return {};
  check_sample(values, "change points");
  const size_t n = values.size();
  const double penalty = 2 + 2 * std::log(static_cast<double>(n));
  const double scale = std::max(noise_of(values), min_step / penalty);
  if (!(scale > 0)) {  // no noise: every step is a change
    std::vector<size_t> all;
    for (size_t i = 1; i < n; ++i) {
      if (values[i] != values[i - 1]) all.push_back(i);
    }
    return all;
  }
  // best[t]: cost of the first t values; from[t]: start of their last segment.
  std::vector<double> best(n + 1, std::numeric_limits<double>::infinity());
  std::vector<size_t> from(n + 1, 0);
  best[0] = -penalty;
  for (size_t t = 1; t <= n; ++t) {
    std::vector<double> segment;
    for (size_t s = t; s-- > 0;) {
      segment.insert(std::ranges::upper_bound(segment, values[s]), values[s]);
      const double cost = best[s] + penalty + deviations_from_median(segment) / scale;
      if (cost <= best[t]) {  // among equal costs, the longest segment
        best[t] = cost;
        from[t] = s;
      }
    }
  }
  std::vector<size_t> cuts;
  for (size_t t = from[n]; t > 0; t = from[t]) cuts.push_back(t);
  std::ranges::reverse(cuts);
  drop_small_steps(values, min_step, cuts);
  return cuts;
}

}  // namespace sextant
