#include "sextant/stats/tests.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "sextant/base/error.h"
#include "sextant/base/philox.h"
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

/// Returns the two-sided p of value t of a discrete distribution over 0, 1, ..; weights[k] is proportional to
/// the probability of k.
double two_sided(const std::vector<double>& weights, size_t t) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double lower = std::accumulate(weights.begin(), weights.begin() + static_cast<long>(t) + 1, 0.0);
  const double upper = std::accumulate(weights.begin() + static_cast<long>(t), weights.end(), 0.0);
  return std::min(1.0, 2 * std::min(lower, upper) / total);
}

/// Returns the two-sided p of a statistic that is approximately normal and takes values in steps of 1, with
/// continuity correction; `deviation` is its difference to its mean.
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

/// Returns the largest k with P(U < k) <= tail for samples of m and n values without ties; above 40 values in
/// total, by the normal approximation.
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

double sign_flip_test(std::span<const double> differences, int samples, uint64_t seed) {
  check_sample(differences, "sign-flip test");
  const size_t n = differences.size();
  if (n <= max_exact_flips) {
    const size_t patterns = size_t{1} << n;
    const auto bit = [](size_t pattern, size_t i) { return (pattern >> i) & 1U; };
    return count_as_extreme(differences, patterns, bit) / static_cast<double>(patterns);
  }
  if (samples < 100) fail("sign-flip test: expected at least 100 samples, got {}", samples);
  PhiloxStream random(seed, 0);
  uint64_t bits = 0;
  const auto coin = [&](size_t, size_t i) {
    if (i % 64 == 0) bits = random.bits();
    return (bits >> (i % 64)) & 1U;
  };
  return (1 + count_as_extreme(differences, static_cast<size_t>(samples), coin)) / (1.0 + samples);
}

double sign_test(int a, int b) {
  SEXTANT_CHECK(a >= 0 && b >= 0);
  const int n = a + b;
  double log_term = -n * std::numbers::ln2;  // log P(K = k)
  double tail = 0;
  for (int k = 0; k <= std::min(a, b); ++k) {
    if (k > 0) log_term += std::log(static_cast<double>(n - k + 1) / k);
    tail += std::exp(log_term);
  }
  return std::min(1.0, 2 * tail);
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
  WilcoxonTest test{.n_used = static_cast<int>(magnitudes.size())};
  if (magnitudes.empty()) return test;
  const std::vector<double> ranks = midranks(magnitudes);
  for (size_t i = 0; i < ranks.size(); ++i) test.W += positive[i] ? ranks[i] : 0;
  if (magnitudes.size() <= max_exact_wilcoxon) {
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
  const double U = rank_sum - m * (m + 1) / 2;
  MannWhitneyTest test;
  test.cliffs_delta = 2 * U / (m * n) - 1;
  std::vector<double> shifts;
  for (const double a : x) {
    for (const double b : y) shifts.push_back(a - b);
  }
  test.hodges_lehmann_shift = median(shifts);
  if (all.size() <= max_exact_mann_whitney) {
    test.p = two_sided(subset_sums_of_size(doubled(ranks), x.size()),
                       static_cast<size_t>(std::lround(2 * rank_sum)));
    return test;
  }
  const double total = m + n;
  const double variance = m * n / 12 * (total + 1 - tie_term(all) / (total * (total - 1)));
  test.p = two_sided_normal(U - m * n / 2, variance);
  return test;
}

std::optional<Interval> hodges_lehmann_interval(std::span<const double> x, std::span<const double> y,
                                                double confidence) {
  check_sample(x, "Hodges-Lehmann interval, first sample");
  check_sample(y, "Hodges-Lehmann interval, second sample");
  if (!(confidence > 0 && confidence < 1)) fail("confidence = {}: must be above 0 and below 1", confidence);
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
  if (values.size() < 4) return 0;  // of two steps, one change alone would determine the MAD
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

/// Returns the first values of the segments, except the first one, whose total cost is least.
std::vector<size_t> cheapest_cuts(std::span<const double> values, double scale, double penalty) {
  const size_t n = values.size();
  // best[t]: cost of the first t values; from[t]: start of their last segment.
  std::vector<double> best(n + 1, std::numeric_limits<double>::infinity());
  std::vector<size_t> from(n + 1, 0);
  best[0] = -penalty;
  for (size_t t = 1; t <= n; ++t) {
    std::vector<double> segment;
    for (size_t s = t; s-- > 0;) {
      segment.insert(std::ranges::upper_bound(segment, values[s]), values[s]);
      const double cost = best[s] + penalty + deviations_from_median(segment) / scale;
      if (cost <= best[t]) {  // of equal costs, the longest last segment wins
        best[t] = cost;
        from[t] = s;
      }
    }
  }
  std::vector<size_t> cuts;
  for (size_t t = from[n]; t > 0; t = from[t]) cuts.push_back(t);
  std::ranges::reverse(cuts);
  return cuts;
}

/// Mean absolute deviation of all values from their median.
double mean_deviation(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::sort(sorted);
  return deviations_from_median(sorted) / static_cast<double>(values.size());
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
  const double penalty = (2 + 2 * std::log(static_cast<double>(n))) * (1 + 4 / static_cast<double>(n));
  const double scale = std::max(noise_of(values), min_step / penalty);
  if (!(scale > 0)) {  // no noise: every step is a change
    std::vector<size_t> all;
    for (size_t i = 1; i < n; ++i) {
      if (values[i] != values[i - 1]) all.push_back(i);
    }
    return all;
  }
  std::vector<size_t> cuts = cheapest_cuts(values, scale, penalty);
  if (n >= 6 && cuts.size() > n / 4)
    cuts = cheapest_cuts(values, std::max(mean_deviation(values), min_step / penalty), penalty);
  drop_small_steps(values, min_step, cuts);
  return cuts;
}

namespace {

/// Returns x with cdf(x) = p in [low, high] for an increasing cdf, by bisection down to the last bits.
template <typename Cdf>
double invert(Cdf cdf, double p, double low, double high) {
  for (int i = 0; i < 200; ++i) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;
    (cdf(middle) < p ? low : high) = middle;
  }
  return low + (high - low) / 2;
}

/// Returns x^a e^-x / Gamma(a).
double gamma_factor(double a, double x) {
  int sign = 0;  // std::lgamma() would write the sign to a global variable, which threads would share
  return std::exp(a * std::log(x) - x - lgamma_r(a, &sign));
}

/// Returns P(a, x) by its power series, which converges fast for x < a + 1.
double gamma_series(double a, double x) {
  double term = 1 / a;
  double sum = term;
  for (double n = a + 1; term > sum * 1e-17; ++n) {
    term *= x / n;
    sum += term;
  }
  return sum * gamma_factor(a, x);
}

/// Returns Q(a, x) = 1 - P(a, x) by Lentz's continued fraction; for x >= a + 1.
double gamma_fraction(double a, double x) {
  constexpr double tiny = 1e-300;
  double b = x + 1 - a;
  double c = 1 / tiny;
  double d = 1 / b;
  double h = d;
  for (int i = 1; i < 100000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = an * d + b;
    if (std::abs(d) < tiny) d = tiny;
    c = b + an / c;
    if (std::abs(c) < tiny) c = tiny;
    d = 1 / d;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-16) break;
  }
  return h * gamma_factor(a, x);
}

/// Returns P(q <= x) of chi-square, the regularised lower incomplete gamma function; relative error below
/// 1e-10.
double chi_square_cdf(double x, double dof) {
  if (x <= 0) return 0;
  const double a = dof / 2;
  return x / 2 < a + 1 ? gamma_series(a, x / 2) : 1 - gamma_fraction(a, x / 2);
}

void check_probability(double p) {
  if (!(p > 0 && p < 1)) fail("quantile of probability {}: must be above 0 and below 1", p);
}

}  // namespace

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double normal_quantile(double p) {
  check_probability(p);
  if (p > 0.5) return -normal_quantile(1 - p);  // the lower tail keeps its precision
  return invert(normal_cdf, p, -40, 1e-9);
}

// Finite series of Abramowitz and Stegun 26.7.3-4.
double student_t_cdf(double x, int dof) {
  if (dof < 1) fail("Student's t: degrees of freedom {}: must be >= 1", dof);
  const bool odd = dof % 2 == 1;
  const double angle = std::atan(x / std::sqrt(dof));
  const double c = std::cos(angle);
  // Odd: cos + 2/3 cos^3 + (2 4)/(3 5) cos^5 ..; even: 1 + 1/2 cos^2 + (1 3)/(2 4) cos^4 ..;
  // up to cos^(dof - 2).
  double term = odd ? c : 1;
  double sum = dof == 1 ? 0 : term;
  for (int k = odd ? 3 : 2; k <= dof - 2; k += 2) {
    term *= c * c * (k - 1) / k;
    sum += term;
  }
  const double within = odd ? 2 / std::numbers::pi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
  return 0.5 + within / 2;
}

double student_t_quantile(double p, int dof) {
  check_probability(p);
  if (dof < 1) fail("Student's t: degrees of freedom {}: must be >= 1", dof);
  if (p > 0.5) return -student_t_quantile(1 - p, dof);
  double low = -1;
  while (student_t_cdf(low, dof) > p && low > -1e12) low *= 2;
  return invert([dof](double x) { return student_t_cdf(x, dof); }, p, low, 1e-9);
}

double chi_square_quantile(double p, double dof) {
  check_probability(p);
  if (!(dof > 0) || !std::isfinite(dof))
    fail("chi-square: degrees of freedom {}: must be finite and > 0", dof);
  double high = dof + 1;
  while (chi_square_cdf(high, dof) < p) high *= 2;
  return invert([dof](double x) { return chi_square_cdf(x, dof); }, p, 0, high);
}

std::optional<RocCurve> roc_curve(std::vector<ScoredDetection> detections) {
  RocCurve out;
  for (const ScoredDetection& detection : detections) {
    if (std::isnan(detection.score)) return std::nullopt;
    ++(detection.is_dynamic ? out.positives : out.negatives);
  }
  if (out.positives == 0 || out.negatives == 0) return std::nullopt;
  std::ranges::sort(detections, std::greater(), &ScoredDetection::score);
  out.points.push_back({std::numeric_limits<double>::infinity(), 0, 0});
  int positives = 0, negatives = 0;
  for (size_t i = 0; i < detections.size();) {
    const double score = detections[i].score;
    for (; i < detections.size() && detections[i].score == score; ++i)
      ++(detections[i].is_dynamic ? positives : negatives);
    const RocPoint& before = out.points.back();
    const RocPoint at{score, static_cast<double>(negatives) / out.negatives,
                      static_cast<double>(positives) / out.positives};
    // Ties form a slope, integrated by trapezoids.
    out.area += (at.false_positive_rate - before.false_positive_rate) * 0.5 *
                (at.true_positive_rate + before.true_positive_rate);
    out.points.push_back(at);
  }
  return out;
}

}  // namespace sextant
