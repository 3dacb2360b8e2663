#pragma once

// Hypothesis tests. All p-values are two-sided unless stated otherwise, in (0, 1]. Empty or non-finite
// samples throw Error.
//
//   sign_flip        paired differences d_i: under the null hypothesis each sign is a fair coin. p = share of
//                    sign patterns with |mean| at least the observed one. All 2^n patterns for n <= 16;
//                    above, (1 + hits) / (1 + samples) from `samples` >= 100 random patterns
//   sign_test        n independent changes, k of them in one direction: under the null hypothesis each
//                    direction is a fair coin (McNemar's exact test for decisions)
//   wilcoxon         signed ranks: zeros are left out (n_used counts the rest), ties get midranks. W = sum of
//                    the ranks of positive d. Exact distribution given the ranks for n_used <= 50 (also
//                    with ties); above, normal with tie and continuity correction
//   mann_whitney     two independent samples, U = #{x > y} + #{x = y} / 2. Exact given the midranks for up to
//                    40 values in total; above, normal with tie and continuity correction
//
// Exact two-sided p = min(1, 2 min(P(T <= t), P(T >= t))).

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Returns p.
double sign_flip_test(std::span<const double> differences, int samples = 10000, uint64_t seed = 1);

/// Returns p = min(1, 2 P(K <= min(a, b))), K binomial with a + b trials of 1/2; 1 for a = b = 0.
double sign_test(int a, int b);

struct WilcoxonTest {
  double W = 0;
  int n_used = 0;
  double p = 1;
};
WilcoxonTest wilcoxon_test(std::span<const double> differences);

struct MannWhitneyTest {
  double p = 1;
  double cliffs_delta = 0;          ///< P(x > y) - P(x < y), -1..1
  double hodges_lehmann_shift = 0;  ///< median of all x - y
};
MannWhitneyTest mann_whitney_test(std::span<const double> x, std::span<const double> y);

/// Returns the interval of shifts that the Mann-Whitney test does not reject at 1 - confidence: between order
/// statistics of all x - y (Hollander and Wolfe 1973), exact for up to 40 values without ties, otherwise by
/// the normal approximation. nullopt if the samples are too small to reject any shift.
std::optional<Interval> hodges_lehmann_interval(std::span<const double> x, std::span<const double> y,
                                                double confidence = 0.95);

/// Returns p-values adjusted after Holm (1979), in the order of `p`: rejecting where the adjusted p <= alpha
/// bounds the probability of any false rejection by alpha. Throws Error for p outside 0..1.
std::vector<double> holm(std::span<const double> p);

// ---- Receiver operating characteristic: how well a score separates dynamic from static objects over all
// thresholds. The area under the curve is U / (n_x n_y) of the Mann-Whitney test.

struct RocPoint {
  double threshold = 0;  ///< scores >= threshold are classified as dynamic
  double false_positive_rate = 0;
  double true_positive_rate = 0;
};

struct RocCurve {
  std::vector<RocPoint> points;  ///< by descending threshold, from (0, 0) at infinity to (1, 1)
  /// Probability that a dynamic score is above a static one, ties counting half (Mann & Whitney 1947).
  double area = 0;
  int positives = 0;
  int negatives = 0;
};

struct ScoredDetection {
  double score = 0;
  bool is_dynamic = false;  ///< ground truth
};

/// Returns the curve; nullopt unless both classes occur and no score is NaN.
std::optional<RocCurve> roc_curve(std::vector<ScoredDetection> detections);

// ---- Change points in the level of a series by optimal partitioning (Jackson et al. 2005): the segmentation
// that minimises
//
//   sum over segments of sum |x - median of the segment| / scale   +   penalty per cut
//
//   penalty   (2 + 2 ln n) (1 + 4 / n); the second factor stands for the uncertainty of the noise of few
//             values
//   scale     noise of the series, 1.4826 MAD of its steps / sqrt 2, but at least min_step / penalty, for
//             which a single value that is off by min_step just pays for one cut. The MAD is that of the
//             noise if fewer than half of the steps are changes; fewer than three steps cannot show it,
//             so the noise of fewer than four values is assumed to be 0. If the scale is 0, every change
//             of the value is a change point
//
// A series of 6 values or more with more than n / 4 changes, such as one that alternates between two
// machines, varies around one level: the scale is then the mean absolute deviation from the median of all
// values, at least min_step / penalty.
//
// Afterwards, adjacent segments whose medians differ by less than `min_step` are joined, the most similar
// ones first.
// With absolute deviations, one outlier inside a segment costs less than the two cuts around it, unless it is
// very large. O(n^3) for n values; meant for the history of a project.

/// Returns the indices of the first values of new segments, ascending and never 0. A series of fewer than 2
/// values has no change point. Throws Error for values that are not finite and for min_step < 0.
std::vector<size_t> change_points(std::span<const double> values, double min_step);

// ---- Distribution functions for tests and intervals. Arguments outside the stated ranges throw Error.
// Boost.Math has all of them, most of them faster (bench/statistics_bench.cc), but its values differ by 1e-16
// to 1e-13, which would change the last digits of intervals in published tables; one interval evaluates only
// a handful of them.

/// normal_cdf() returns P(n <= x) of the standard normal distribution; normal_quantile() is its inverse, for
/// 0 < p < 1.
double normal_cdf(double x);
double normal_quantile(double p);

/// Returns q with P(chi-square with `dof` > 0 degrees of freedom <= q) = p, 0 < p < 1.
double chi_square_quantile(double p, double dof);

/// Returns P(T <= x) of Student's t with `dof` >= 1 degrees of freedom.
double student_t_cdf(double x, int dof);
/// Returns t with P(T <= t) = p of Student's t with `dof` >= 1 degrees of freedom, 0 < p < 1.
double student_t_quantile(double p, int dof);

}  // namespace sextant
