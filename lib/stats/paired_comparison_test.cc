#include <gtest/gtest.h>
#include <cmath>
#include <numbers>
#include <random>

#include "sextant/base/philox.h"
#include "sextant/base/testing.h"
#include "sextant/stats/paired_comparison.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/testing.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

/// A sample of `n_seeds` seeds with 5 frames each and errors around `size`. NEW has `factor` times the errors
/// of BASE, resampled if `independent`.
PairedSample sample(PhiloxStream& random, size_t stratum, size_t n_seeds, double size, double factor,
                    bool independent) {
  const auto draw = [&] {
    return size * std::hypot(standard_normal(random), standard_normal(random), standard_normal(random));
  };
  PairedSample out{.stratum = stratum, .cases = {}};
  for (uint64_t seed = 0; seed < n_seeds; ++seed) {
    for (int frame = 0; frame < 5; ++frame) {
      const double base = draw();
      out.cases.push_back({seed, frame, base, factor * (independent ? draw() : base)});
    }
  }
  return out;
}

RatioChange change_of(const std::vector<PairedSample>& samples) {
  std::vector<const PairedSample*> pointers;
  for (const PairedSample& one : samples) pointers.push_back(&one);
  return ratio_of_means(pointers);
}

TEST(RatioOfMeans, AFactorIsFoundExactlyForAnyErrors) {
  PhiloxStream random(1, 0);
  const RatioChange up =
      change_of({sample(random, 0, 6, 1e-3, 1.1, false), sample(random, 1, 6, 50, 1.1, false)});
  EXPECT_NEAR(up.change, 0.1, 1e-12);
  EXPECT_NEAR(up.interval.value().low, 0.1, 1e-9);
  EXPECT_LT(up.p.value(), 1e-12);
  const RatioChange down = change_of({sample(random, 0, 6, 1e-3, 0.5, false)});
  EXPECT_NEAR(down.change, -0.5, 1e-12);
  EXPECT_LT(down.p.value(), 1e-6);
}

TEST(RatioOfMeans, OneSampleIsTheRatioEstimatorOfCochran) {
  // Worked by hand: B = (1, 2, 3), N = (2, 2, 5); ratio 9/6, influences (0.5, -1, 0.5) / 6, v = 3/2 * 1.5/36.
  PairedSample one{.stratum = 0, .cases = {{0, 7, 1, 2}, {1, 7, 2, 2}, {2, 7, 3, 5}}};
  const RatioChange change = change_of({one});
  EXPECT_NEAR(change.change, 0.5, 1e-12);
  const double half = (change.interval->high - change.interval->low) / 2;
  EXPECT_NEAR(half, 4.302652729911275 * 0.25, 1e-6);  // t quantile for 2 degrees of freedom
  EXPECT_EQ(change.p.value(), 0.5);                   // t = 2: 0.18, but two cases changed: 2^(1 - 2)
}

TEST(RatioOfMeans, ExchangingTheSidesChangesOnlyTheSign) {
  PhiloxStream random(2, 0);
  PairedSample there = sample(random, 0, 8, 1, 1.2, true), back = there;
  for (PairedCase& one : back.cases) std::swap(one.base, one.fresh);
  const RatioChange a = change_of({there}), b = change_of({back});
  EXPECT_NEAR((1 + a.change) * (1 + b.change), 1, 1e-12);
  EXPECT_NEAR(a.p.value(), b.p.value(), 1e-12);
}

TEST(RatioOfMeans, TheChangeIsTheMeanOverSamplesThatMoveInOppositeDirections) {
  // One sample improves by a large factor, which must not hide that the others get worse.
  PhiloxStream random(6, 0);
  const auto of = [&](std::vector<double> factors) {
    std::vector<PairedSample> samples;
    for (size_t i = 0; i < factors.size(); ++i)
      samples.push_back(sample(random, i, 10, 1, factors[i], false));
    return change_of(samples);
  };
  const RatioChange worse = of({0.1, 2.62});
  EXPECT_NEAR(worse.change, 0.36, 1e-12);
  EXPECT_GT(worse.interval.value().low, 0);
  const RatioChange better = of({0.02, 1.05, 1.05, 1.05, 1.05});
  EXPECT_NEAR(better.change, -0.156, 1e-12);
  EXPECT_LT(better.interval.value().low, -0.156);
  EXPECT_GT(better.interval.value().high, -0.156);
}

TEST(RatioOfMeans, OneOutlierProvesNothing) {
  PhiloxStream random(3, 0);
  for (const double outlier : {10.0, 1e3, 1e9}) {
    PairedSample one = sample(random, 0, 10, 1, 1, false);
    one.cases[23].fresh += outlier;
    EXPECT_GT(change_of({one}).p.value(), 0.3) << outlier;
    EXPECT_GT(change_of({one, sample(random, 1, 10, 1, 1, false)}).p.value(), 0.3) << outlier;
    for (PairedCase& pair : one.cases) std::swap(pair.base, pair.fresh);
    EXPECT_GT(change_of({one}).p.value(), 0.3) << outlier;
  }
}

TEST(RatioOfMeans, HasNominalSizeForRedrawnErrorsAndFindsPlantedOnes) {
  int n_false = 0, n_found = 0;
  constexpr int n = 1000;
  for (int draw = 0; draw < n; ++draw) {
    PhiloxStream random(4, static_cast<uint64_t>(draw));
    const auto p = [&](double factor) {
      std::vector<PairedSample> samples;
      for (size_t source = 0; source < 3; ++source)
        samples.push_back(sample(random, source, 6, 1 + static_cast<double>(source), factor, true));
      return change_of(samples).p.value();
    };
    n_false += p(1) <= 0.05;
    n_found += p(1.4) <= 0.05;
  }
  EXPECT_LE(n_false, 75);
  EXPECT_GE(n_false, 10);
  EXPECT_GE(n_found, 950);
}

TEST(RatioOfMeans, FrameEffectsCommonToAllSeedsAreNotSignificant) {
  // In all seeds, each frame is better or worse by its own factor, as after a change of the order of points.
  int n_false = 0;
  for (int draw = 0; draw < 1000; ++draw) {
    PhiloxStream random(5, static_cast<uint64_t>(draw));
    std::vector<PairedSample> samples;
    for (size_t source = 0; source < 3; ++source) {
      samples.push_back(sample(random, source, 10, 1, 1, false));
      double factors[5];
      for (double& factor : factors) factor = std::exp(0.3 * standard_normal(random));
      for (PairedCase& one : samples.back().cases) one.fresh *= factors[one.frame];
    }
    n_false += change_of(samples).p.value() <= 0.05;
  }
  EXPECT_LE(n_false, 80);
}

TEST(RatioOfMeans, WithoutRepetitionThereIsNoTest) {
  const PairedSample one{.stratum = 0, .cases = {{0, 0, 1, 2}}};
  const RatioChange change = change_of({one});
  EXPECT_EQ(change.change, 1);
  EXPECT_FALSE(change.interval || change.p || change.detectable);
}

TEST(RatioOfMeans, MeansOfZeroStayFinite) {
  const PairedSample appears{.stratum = 0, .cases = {{0, 0, 0, 1}, {1, 0, 0, 2}, {2, 0, 0, 1}, {3, 0, 0, 2}}};
  const PairedSample never{.stratum = 0, .cases = {{0, 0, 0, 0}, {1, 0, 0, 0}}};
  const RatioChange up = change_of({appears});
  EXPECT_TRUE(std::isfinite(up.change) && std::isfinite(up.p.value()));
  EXPECT_GT(up.change, 1);
  EXPECT_EQ(change_of({never}).change, 0);
  EXPECT_EQ(change_of({never}).p.value(), 1);
}

}  // namespace

namespace {

using Values = std::vector<double>;
using Labels = std::vector<uint64_t>;

TEST(PairedComparison, PairingRemovesCommonVariation) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  Values differences;
  for (int i = 0; i < 50; ++i) {
    const double common = 10 * normal(random);
    const double a = common + 0.5 + 0.1 * normal(random);
    differences.push_back(a - (common + 0.1 * normal(random)));
  }
  const PairedComparison c = compare_pairs(differences);
  EXPECT_NEAR(c.difference, 0.5, 0.08);
  ASSERT_TRUE(c.interval);
  EXPECT_GT(c.interval->low, 0.4);
  EXPECT_LT(c.interval->high, 0.6);
  EXPECT_LT(*c.p, 1e-6);
  EXPECT_EQ(c.n_clusters, 50);
  EXPECT_EQ(c.n_used, 50);
}

TEST(PairedComparison, TestsUseTheMeansOfTheClusters) {
  const Values differences = {1, 3, -2, 0, 4, 4, 1, -1};
  const Labels seeds = {7, 7, 2, 2, 9, 9, 5, 5};  // means by label: -1, 0, 2, 4
  const Values means = {-1, 0, 2, 4};
  const PairedComparison ranks = compare_pairs(differences, seeds);
  EXPECT_EQ(ranks.n_clusters, 4);
  EXPECT_EQ(ranks.n_used, 3);
  EXPECT_EQ(ranks.difference, 1.25);
  EXPECT_EQ(*ranks.p, wilcoxon_test(means).p);  // ranks and mean have the same sign
  EXPECT_EQ(*ranks.detectable, minimum_detectable_effect(std_dev(means), 4));
  const auto interval = bootstrap_by_cluster(differences, seeds, mean);
  EXPECT_EQ(ranks.interval->low, interval->low);
  EXPECT_EQ(ranks.interval->high, interval->high);
}

TEST(PairedComparison, RanksAgainstTheMeanProveNothing) {
  Values differences(36, 0.3);
  EXPECT_LT(*compare_pairs(differences).p, 1e-6);
  differences[7] = -50;  // the mean falls, although 35 of 36 values rise
  EXPECT_EQ(*compare_pairs(differences).p, 1);
  differences[7] = -1;
  EXPECT_LT(*compare_pairs(differences).p, 1e-6);
}

TEST(PairedComparison, OneClusterHasNoIntervalAndNoTest) {
  const PairedComparison c = compare_pairs(Values{1, 2}, Labels{3, 3});
  EXPECT_FALSE(c.interval || c.detectable);
  EXPECT_EQ(*c.p, 1);
  EXPECT_THROW(compare_pairs(Values{}), Error);
  EXPECT_THROW(compare_pairs(Values{NAN, 1}), Error);
  EXPECT_THROW(compare_pairs(Values{1, 2}, Labels{1}), InternalError);
}

TEST(PairedComparison, HolmCorrectsTheTestsWithAPValue) {
  PairedComparison a, b, untested;
  a.p = 0.02;
  b.p = 0.03;
  correct_by_holm<PairedComparison>({&a, &untested, &b});
  EXPECT_DOUBLE_EQ(*a.p_corrected, 0.04);
  EXPECT_DOUBLE_EQ(*b.p_corrected, 0.04);
  EXPECT_FALSE(untested.p_corrected);
}

}  // namespace

}  // namespace sextant
