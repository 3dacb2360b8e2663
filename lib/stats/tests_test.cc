// Tests against scipy 1.10.1, against enumeration of all outcomes (itertools), and against examples worked by
// hand.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cmath>
#include <random>

#include "sextant/base/error.h"
#include "sextant/base/philox.h"
#include "sextant/base/testing.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

using Values = std::vector<double>;

// Hollander and Wolfe (1973), 29f: depression scale of nine patients before and after; the example of R's
// wilcox.test. scipy.stats.wilcoxon(x - y, mode='exact'): 0.0390625, rank sum of the other side 5.
TEST(Wilcoxon, GivesThePublishedExample) {
  const Values x = {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30};
  const Values y = {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
  Values d;
  for (size_t i = 0; i < x.size(); ++i) d.push_back(x[i] - y[i]);
  const WilcoxonTest test = wilcoxon_test(d);
  EXPECT_EQ(test.W, 40);
  EXPECT_EQ(test.n_used, 9);
  EXPECT_DOUBLE_EQ(test.p, 0.0390625);
}

// All 2^9 signs over scipy.stats.rankdata(abs(d)): W = 34, p = 0.17578125.
TEST(Wilcoxon, IsExactWithTiesAndZeros) {
  const WilcoxonTest test = wilcoxon_test(Values{0, 1, 1, -1, 2, -3, 2, 4, 4, -0.5});
  EXPECT_EQ(test.W, 34);
  EXPECT_EQ(test.n_used, 9);
  EXPECT_DOUBLE_EQ(test.p, 0.17578125);
}

// d = np.round(np.random.default_rng(1).normal(0.2, 1, 80), 1); scipy.stats.wilcoxon(d[d != 0],
// mode='approx', correction=True): statistic 1217.5 of 78, p = 0.10789014311267978.
TEST(Wilcoxon, UsesTheCorrectedNormalForLargeSamples) {
  const Values d = {0.5,  1.0,  0.5,  -1.1, 1.1,  0.6,  -0.3, 0.8,  0.6,  0.5,  0.2,  0.7,  -0.5, 0.0,
                    -0.3, 0.8,  0.2,  -0.1, -0.6, -0.1, 0.2,  -0.1, 1.5,  1.2,  -2.5, -1.7, 0.0,  -0.2,
                    0.4,  0.4,  2.3,  -0.9, -0.2, 2.2,  0.8,  0.9,  -0.3, -1.4, 0.4,  0.3,  -1.0, -0.5,
                    0.1,  -0.7, 0.1,  0.3,  0.2,  -0.3, 0.8,  1.1,  0.5,  -0.6, 0.9,  -0.3, 1.1,  -0.9,
                    1.1,  0.2,  -1.0, -0.1, 0.3,  0.5,  -0.8, -0.9, 0.4,  -0.3, 0.4,  1.0,  -1.4, 0.5,
                    1.4,  -0.1, -0.6, 1.0,  0.5,  1.1,  -0.1, -1.3, 0.1,  -0.2};
  const WilcoxonTest test = wilcoxon_test(d);
  EXPECT_EQ(test.n_used, 78);
  EXPECT_EQ(test.W, 78 * 79 / 2 - 1217.5);
  EXPECT_NEAR(test.p, 0.10789014311267978, 1e-12);
}

TEST(Wilcoxon, AllZerosGiveAPValueOfOne) {
  const WilcoxonTest test = wilcoxon_test(Values{0, 0, 0});
  EXPECT_EQ(test.n_used, 0);
  EXPECT_EQ(test.p, 1);
}

// itertools.product((1, -1), repeat=7): 30 of 128 sums are as large.
TEST(SignTest, IsTheTailOfTheBinomialDistribution) {
  EXPECT_EQ(sign_test(0, 0), 1);
  EXPECT_DOUBLE_EQ(sign_test(3, 0), 0.25);
  EXPECT_DOUBLE_EQ(sign_test(1, 7), 2 * 9.0 / 256);
  EXPECT_DOUBLE_EQ(sign_test(4, 4), 1);
  EXPECT_NEAR(sign_test(60, 40), 0.056887933, 1e-9);  // scipy.stats.binomtest(60, 100).pvalue
  EXPECT_NEAR(sign_test(0, 1000) / std::ldexp(2.0, -1000), 1, 1e-9);
}

TEST(SignFlip, CountsAllPatterns) {
  EXPECT_DOUBLE_EQ(sign_flip_test(Values{0.3, -0.1, 0.5, 0.2, 0.2, -0.4, 0.9}), 30.0 / 128);
  EXPECT_EQ(sign_flip_test(Values{1, 2, 3}), 0.25);
  EXPECT_EQ(sign_flip_test(Values{0, 0}), 1);
}

TEST(SignFlip, SamplesAgreeWithTheNormalApproximationAndRepeat) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0.2, 1);
  Values d;
  double sum = 0, squares = 0;
  for (int i = 0; i < 100; ++i) {
    d.push_back(normal(random));
    sum += d.back();
    squares += d.back() * d.back();
  }
  const double expected = std::erfc(std::abs(sum) / std::sqrt(squares) / std::sqrt(2.0));
  const double p = sign_flip_test(d, 20000, 3);
  EXPECT_NEAR(p, expected, 4 * std::sqrt(expected / 20000) + 0.002);
  EXPECT_EQ(p, sign_flip_test(d, 20000, 3));
  // Never 0, however extreme the sample.
  EXPECT_DOUBLE_EQ(sign_flip_test(Values(40, 1.0), 1000), 1.0 / 1001);
}

// Hollander and Wolfe (1973), 69f: permeability constants, the example of R's wilcox.test.
// scipy.stats.mannwhitneyu(x, y, method='exact'): U = 35, p = 0.2544122544122544.
TEST(MannWhitney, GivesThePublishedExample) {
  const MannWhitneyTest test =
      mann_whitney_test(Values{0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46},
                        Values{1.15, 0.88, 0.90, 0.74, 1.21});
  EXPECT_NEAR(test.p, 0.2544122544122544, 1e-14);
  EXPECT_NEAR(test.cliffs_delta, 2 * 35.0 / 50 - 1, 1e-15);
}

// All itertools.combinations of scipy.stats.rankdata(x + y); shift and delta by numpy over all pairs.
TEST(MannWhitney, IsExactWithTies) {
  const MannWhitneyTest test = mann_whitney_test(Values{1, 2, 2, 5, 7}, Values{2, 3, 1, 1});
  EXPECT_NEAR(test.p, 0.38095238095238093, 1e-15);
  EXPECT_EQ(test.hodges_lehmann_shift, 1);
  EXPECT_NEAR(test.cliffs_delta, 0.4, 1e-15);
}

// The generator of the Wilcoxon test above, continued: x = np.round(rng.normal(0, 1, 30), 1), y =
// np.round(rng.normal(0.5, 1, 25), 1); scipy.stats.mannwhitneyu(x, y, method='asymptotic',
// use_continuity=True): U = 305, p = 0.23970713591366222.
TEST(MannWhitney, UsesTheCorrectedNormalForLargeSamples) {
  const Values x = {0.8,  0.2,  -1.6, -1.2, 0.9, 0.7,  -0.6, 0.0,  0.4, 0.5, 0.9, 0.3,  -0.1, -0.3, 1.1,
                    -2.3, -0.1, 0.0,  -1.4, 0.3, -0.7, 0.9,  -0.1, 0.7, 1.2, 0.4, -0.9, -1.5, 1.8,  -0.1};
  const Values y = {-0.2, 0.6, 0.3,  1.4,  0.5, 0.5,  -0.2, 1.0, -0.5, 1.2, 2.0, -1.0, -2.0,
                    1.1,  3.0, -0.5, -0.8, 1.1, -0.3, 0.0,  0.2, 1.0,  0.1, 0.8, 0.3};
  const MannWhitneyTest test = mann_whitney_test(x, y);
  EXPECT_NEAR(test.cliffs_delta, 2 * 305.0 / 750 - 1, 1e-15);
  EXPECT_NEAR(test.p, 0.23970713591366222, 1e-12);
}

TEST(MannWhitney, OfEqualSamplesIsOne) {
  EXPECT_EQ(mann_whitney_test(Values{1, 1}, Values{1, 1, 1}).p, 1);
  EXPECT_EQ(mann_whitney_test(Values(30, 1.0), Values(30, 1.0)).p, 1);
}

// Worked by hand: m = 5, sorted p-values 0.005 0.01 0.03 0.04 0.2.
TEST(Corrections, AreThoseOfHolm) {
  const Values p = {0.01, 0.04, 0.03, 0.005, 0.2};
  EXPECT_THAT(holm(p), ElementsAre(DoubleNear(0.04, 1e-15), DoubleNear(0.09, 1e-15), DoubleNear(0.09, 1e-15),
                                   DoubleNear(0.025, 1e-15), DoubleNear(0.2, 1e-15)));
  EXPECT_THAT(holm(Values{0.5, 0.6}), ElementsAre(1, 1));
  EXPECT_TRUE(holm(Values{}).empty());
  EXPECT_THROW(holm(Values{1.5}), Error);
  EXPECT_THROW(holm(Values{NAN}), Error);
}

// Under the null hypothesis no test may reject more often than its level.
TEST(Tests, KeepTheirLevel) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  int wilcoxon = 0, sign_flip = 0, mann_whitney = 0;
  constexpr int experiments = 1000;
  for (int i = 0; i < experiments; ++i) {
    Values d, x, y;
    for (int k = 0; k < 12; ++k) {
      d.push_back(normal(random));
      x.push_back(normal(random));
      y.push_back(normal(random));
    }
    wilcoxon += wilcoxon_test(d).p <= 0.05;
    sign_flip += sign_flip_test(d) <= 0.05;
    mann_whitney += mann_whitney_test(x, y).p <= 0.05;
  }
  for (const int rejections : {wilcoxon, sign_flip, mann_whitney}) {
    EXPECT_LE(rejections, 0.05 * experiments + 4 * std::sqrt(0.0475 * experiments));
    EXPECT_GE(rejections, 0.02 * experiments);  // and it does reject sometimes
  }
}

TEST(Tests, RefuseEmptyAndNonFiniteSamples) {
  for (const Values& bad : {Values{}, Values{1, NAN}}) {
    EXPECT_THROW(wilcoxon_test(bad), Error);
    EXPECT_THROW(sign_flip_test(bad), Error);
    EXPECT_THROW(mann_whitney_test(bad, Values{1}), Error);
    EXPECT_THROW(mann_whitney_test(Values{1}, bad), Error);
  }
  EXPECT_THROW(sign_flip_test(Values(20, 1.0), 0), Error);
}

TEST(HodgesLehmann, IntervalContainsTheShiftsThatTheTestAccepts) {
  const std::vector<double> x = {1.1, 2.7, 3.2, 4.9, 5.3}, y = {0.2, 0.9, 1.7, 2.2, 2.6};
  const auto interval = hodges_lehmann_interval(x, y, 0.95);
  ASSERT_TRUE(interval);
  const auto p_of_shift = [&](double shift) {
    std::vector<double> moved;
    for (const double v : x) moved.push_back(v - shift);
    return mann_whitney_test(moved, y).p;
  };
  constexpr double hair = 1e-9;
  EXPECT_LE(p_of_shift(interval->low - hair), 0.05);
  EXPECT_GT(p_of_shift(interval->low + hair), 0.05);
  EXPECT_GT(p_of_shift(interval->high - hair), 0.05);
  EXPECT_LE(p_of_shift(interval->high + hair), 0.05);
}

TEST(HodgesLehmann, TooFewValuesHaveNoInterval) {
  const std::vector<double> three = {1, 2, 3}, four = {1, 2, 3, 4};
  EXPECT_FALSE(hodges_lehmann_interval(three, three));  // smallest p: 0.1
  EXPECT_TRUE(hodges_lehmann_interval(four, four));     // 0.029
}

TEST(HodgesLehmann, ManyValuesByTheNormalApproximation) {
  std::vector<double> x, y;
  for (int i = 0; i < 30; ++i) {
    x.push_back(i * 0.1 + 5);
    y.push_back(i * 0.1 + 0.01);
  }
  const auto interval = hodges_lehmann_interval(x, y);
  ASSERT_TRUE(interval);
  EXPECT_NEAR((interval->low + interval->high) / 2, 4.99, 1e-9);
  EXPECT_NEAR(interval->high - interval->low, 0.9, 0.15);
}

}  // namespace

namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ChangePoints, ExactSeriesChangeWhereTheyStep) {
  const std::vector<double> values = {1, 1, 1, 1.2, 1.2, 1.2, 1.2, 0.9};
  EXPECT_THAT(change_points(values, 0.05), ElementsAre(3, 7));
  EXPECT_THAT(change_points(values, 0), ElementsAre(3, 7));
  EXPECT_THAT(change_points(values, 0.25), ElementsAre(7));
  EXPECT_THAT(change_points(values, 1), IsEmpty());
  EXPECT_THAT(change_points(std::vector<double>{1, 2}, 0.5), ElementsAre(1));
  EXPECT_THAT(change_points(std::vector<double>{1}, 0.5), IsEmpty());
}

TEST(ChangePoints, FewerThanFourValuesAreAssumedToHaveNoNoise) {
  EXPECT_THAT(change_points(std::vector<double>{1, 1, 3}, 0.01), ElementsAre(2));
  EXPECT_THAT(change_points(std::vector<double>{1, 3, 3}, 0.01), ElementsAre(1));
  EXPECT_THAT(change_points(std::vector<double>{1, 2, 3}, 0.01), ElementsAre(1, 2));
  EXPECT_THAT(change_points(std::vector<double>{1, 1.005, 3}, 0.01), ElementsAre(2));
  EXPECT_THAT(change_points(std::vector<double>{1, 1, 1, 3}, 0.01), ElementsAre(3));
}

TEST(ChangePoints, FindsAStepOfFourSigmaAndNoneInNoise) {
  int n_false = 0, n_found = 0;
  for (uint64_t draw = 1; draw <= 50; ++draw) {
    PhiloxStream random(draw, 0);
    std::vector<double> values;
    for (int i = 0; i < 30; ++i) values.push_back(100 + standard_normal(random));
    n_false += !change_points(values, 1).empty();
    for (size_t i = 18; i < values.size(); ++i) values[i] += 4;
    n_found += change_points(values, 1) == std::vector<size_t>{18};
  }
  EXPECT_LE(n_false, 2);
  EXPECT_GE(n_found, 40);
}

TEST(ChangePoints, ASeriesThatAlternatesHasOneLevel) {
  std::vector<double> values;
  for (int i = 0; i < 12; ++i) values.push_back(i % 2 == 0 ? 1 : 1.05);
  EXPECT_THAT(change_points(values, 0.01), IsEmpty());
  for (size_t i = 6; i < values.size(); ++i) values[i] += 1;  // a change that exceeds the variation
  EXPECT_THAT(change_points(values, 0.01), ElementsAre(6));
}

TEST(ChangePoints, SixNoisyValuesRarelyShowAChange) {
  int n_false = 0;
  for (uint64_t draw = 1; draw <= 300; ++draw) {
    PhiloxStream random(draw, 1);
    std::vector<double> values;
    for (int i = 0; i < 6; ++i) values.push_back(100 + 5 * standard_normal(random));
    n_false += !change_points(values, 1).empty();
  }
  EXPECT_LE(n_false, 18);
}

TEST(ChangePoints, OneDisturbedValueIsNoChange) {
  std::vector<double> values;
  PhiloxStream random(3, 0);
  for (int i = 0; i < 20; ++i) values.push_back(100 + standard_normal(random));
  values[9] += 8;
  EXPECT_THAT(change_points(values, 1), IsEmpty());
}

TEST(ChangePoints, RefusesValuesThatAreNotFinite) {
  EXPECT_THROW(change_points(std::vector<double>{1, NAN}, 0.1), Error);
  EXPECT_THROW(change_points(std::vector<double>{1, 2}, -1), Error);
}

TEST(RocCurve, AreaIsTheShareOfPairsInOrder) {
  // Pairs (dynamic, static): 3 > 1, 3 > 2, 2 > 1, and 2 = 2 counts half.
  const auto curve = roc_curve({{3, true}, {2, true}, {2, false}, {1, false}});
  ASSERT_TRUE(curve);
  EXPECT_DOUBLE_EQ(curve->area, 3.5 / 4);
  EXPECT_EQ(curve->positives, 2);
  EXPECT_EQ(curve->negatives, 2);
  ASSERT_EQ(curve->points.size(), 4U);
  EXPECT_DOUBLE_EQ(curve->points[1].true_positive_rate, 0.5);
  EXPECT_DOUBLE_EQ(curve->points[1].false_positive_rate, 0);
  EXPECT_DOUBLE_EQ(curve->points[2].false_positive_rate, 0.5);
  EXPECT_DOUBLE_EQ(curve->points[3].false_positive_rate, 1);
}

TEST(RocCurve, PerfectAndUseless) {
  EXPECT_DOUBLE_EQ(roc_curve({{2, true}, {1, false}})->area, 1);
  EXPECT_DOUBLE_EQ(roc_curve({{1, true}, {2, false}})->area, 0);
  EXPECT_DOUBLE_EQ(roc_curve({{1, true}, {1, false}, {1, false}})->area, 0.5);
}

TEST(RocCurve, NeedsBothKindsAndNumbers) {
  EXPECT_FALSE(roc_curve({}));
  EXPECT_FALSE(roc_curve({{1, true}, {2, true}}));
  EXPECT_FALSE(roc_curve({{1, true}, {NAN, false}}));
}

}  // namespace

}  // namespace sextant
