#pragma once

// Change of a mean error between two runs, BASE and NEW, of the same cases: a ratio of means, pooled over
// samples. A sample holds the cases of one body in one source; each case belongs to a seed and a frame.
// Sources are strata, since they are fixed, while seeds and frames within a source are crossed random
// samples. Clustering by seed alone would be wrong: a neutral change, such as another order of the points,
// can raise the error of one frame and lower that of the next by the same amount in all seeds.
//
//   pooling        r = sum_s w_s (N_s / B_s - 1), N_s and B_s the sums of sample s, w_s its share of all
//                  cases
//   influence      g = sum_s w_s (N_si - (N_s / B_s) B_si) / min(B_s, N_s) of cell i, one seed and frame of a
//                  source: linearisation (delta method), with the smaller of both sums as the unit. 0
//                  everywhere if NEW is a multiple of BASE. The smaller sum is the better side, without
//                  outliers; hence a single outlier on either side is never significant: it changes r and its
//                  standard error alike, t <= 1
//   variance       of a clustering: sum over strata of n / (n - 1) sum_j (G_j - mean G)^2, G_j the sums of g
//                  over the n clusters. With seeds S, frames F and cells C: v = max(v_S, v_F, v_S + v_F -
//                  v_C), two-way clustering. A stratum with one seed has v_F alone, with one frame v_S alone
//   dof            the smaller of those of S and F, each after Satterthwaite: v^2 / sum_k (v_k^2 / (n_k -
//                  1)), at most 1000 and rounded down
//   p              two-sided, of r / sqrt(v) after Student's t, but never below 2^(1 - n) for n cases that
//                  changed: the smallest p of a sign test
//   interval       95 %: r -+ t sqrt(v); below r = 0, where the unit is the sum of NEW,
//                  (1 + r) / (1 +- t sqrt(v)) - 1. It excludes 0 if p is below 0.05, except where 2^(1 - n)
//                  raises p
//   detectable     k / (1 - k), k = (t_{1 - alpha/2} + t_0.8) sqrt(v): smallest increase found at alpha
//                  with probability 80 %. The standard error grows with the errors, by 1 + r
//
// Cochran, Sampling Techniques (1977), 6.3 and 6.11 (ratio estimators); Cameron, Gelbach and Miller (2011),
// Robust inference with multiway clustering; Satterthwaite (1946).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sextant/stats/bootstrap.h"
#include "sextant/stats/tests.h"

namespace sextant {

/// The errors of one case in both runs.
struct PairedCase {
  uint64_t seed = 0;
  int frame = 0;
  double base = 0;   ///< error in BASE
  double fresh = 0;  ///< error in NEW
};

/// Cases of one body in one source; the errors are finite and >= 0.
struct PairedSample {
  size_t stratum = 0;
  std::vector<PairedCase> cases;
};

struct RatioChange {
  double change = 0;                 ///< NEW / BASE - 1
  std::optional<Interval> interval;  ///< nullopt without p, and if an end would be infinite
  std::optional<double> p;           ///< nullopt if a stratum has only one cell
  std::optional<double> detectable;  ///< nullopt without p, and if no increase is found
};

/// Returns the pooled change. A mean below `smallest` > 0 counts as `smallest`, so that ratios stay finite.
/// `alpha` is the level at which `detectable` is computed.
RatioChange ratio_of_means(std::span<const PairedSample* const> samples, double smallest = 1e-9,
                           double alpha = 0.05);

// Paired comparison of two methods on the same cases, from the differences case by case. A cluster is a group
// of cases that was sampled as a unit (bootstrap.h); a test uses one value per cluster, the mean of its
// differences. Empty or non-finite samples throw Error.
//
//   difference   mean over all cases; its interval by cluster bootstrap
//   p            two-sided, of the cluster means: Wilcoxon signed-rank test (tests.h). Where the signed ranks
//                point the other way than the mean, because of an outlier, p is 1
//   p_corrected  by Holm over the comparisons that are made together: correct_by_holm()
//   detectable   smallest mean that this number of clusters detects at 5 % with probability 80 % (trend.h)

struct PairedComparison {
  double difference = 0;
  std::optional<Interval> interval;  ///< nullopt with fewer than 2 clusters
  int n_clusters = 0;
  int n_used = 0;  ///< number of clusters whose mean is not 0
  std::optional<double> p;
  std::optional<double> p_corrected;
  std::optional<double> detectable;  ///< nullopt with fewer than 2 clusters
};

/// Compares pairs by their differences: differences[i] belongs to the cluster with label cluster[i]; without
/// labels every difference is its own cluster.
PairedComparison compare_pairs(std::span<const double> differences, std::span<const uint64_t> cluster = {},
                               const BootstrapOptions& bootstrap = {});

/// Applies Holm's correction to tests that are made together: each test that has a `p` gets its
/// `p_corrected`.
template <typename Test>
void correct_by_holm(const std::vector<Test*>& family) {
  std::vector<double> p;
  for (const Test* test : family) {
    if (test->p) p.push_back(*test->p);
  }
  const std::vector<double> corrected = holm(p);
  size_t k = 0;
  for (Test* test : family) {
    if (test->p) test->p_corrected = corrected[k++];
  }
}

}  // namespace sextant
