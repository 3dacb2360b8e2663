#include "sextant/stats/trend.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

using Values = std::vector<double>;
using Labels = std::vector<uint64_t>;

/// Slope of errors, where error[i] was measured at level[i] in the cluster seed[i].
NoiseSlope slope_of(const Values& level, const Values& error, const Labels& seed,
                    const BootstrapOptions& options = {}) {
  std::map<double, std::pair<Values, Labels>> by_level;
  for (size_t i = 0; i < level.size(); ++i) {
    by_level[level[i]].first.push_back(error[i]);
    by_level[level[i]].second.push_back(seed[i]);
  }
  std::vector<LevelSums> levels;
  for (const auto& [at, sample] : by_level) levels.push_back({at, cluster_sums(sample.first, sample.second)});
  return noise_slope(levels, options);
}

// scipy.stats.linregress: slope 1.015, intercept 0.965. Mean error at level 0: 0.9.
TEST(NoiseSlope, IsTheLeastSquaresLine) {
  const NoiseSlope fit =
      slope_of(Values{0, 1, 2, 3, 0, 1, 2, 3}, Values{1, 1.9, 3.2, 4.1, 0.8, 2.2, 2.9, 3.8},
               Labels{1, 1, 1, 1, 2, 2, 2, 2});
  EXPECT_NEAR(fit.slope, 1.015, 1e-12);
  EXPECT_NEAR(*fit.relative_slope, 1.015 / 0.9, 1e-12);
  ASSERT_TRUE(fit.interval && fit.relative_interval);
  // The slopes of the two seeds alone (1.06 and 0.97) bound the slope of any resample.
  EXPECT_GE(fit.interval->low, 0.97 - 1e-9);
  EXPECT_LE(fit.interval->high, 1.06 + 1e-9);
}

TEST(NoiseSlope, CoversTheTrueSlopeWhenSeedsAreClusters) {
  int hits = 0, relative_hits = 0;
  constexpr int experiments = 400;
  for (int e = 0; e < experiments; ++e) {
    std::mt19937_64 random(static_cast<unsigned>(e) + 1);
    std::normal_distribution<double> normal;
    Values level, error;
    Labels seed;
    for (uint64_t s = 0; s < 40; ++s) {
      const double steepness = 2 + 0.5 * normal(random);
      for (int l = 1; l <= 5; ++l) {
        level.push_back(0.1 * l);
        error.push_back(1 + steepness * (0.1 * l - 0.1) + 0.05 * normal(random));
        seed.push_back(s);
      }
    }
    const NoiseSlope fit = slope_of(level, error, seed, {.replicates = 400});
    hits += fit.interval->low <= 2 && 2 <= fit.interval->high;
    relative_hits += fit.relative_interval->low <= 2 && 2 <= fit.relative_interval->high;
  }
  for (const int n : {hits, relative_hits}) {
    EXPECT_GE(n, 0.915 * experiments);  // 0.95 less 3 standard errors and the bias of 40 clusters
    EXPECT_LE(n, 0.98 * experiments);
  }
}

TEST(NoiseSlope, RefusesDataWithoutASlope) {
  EXPECT_THROW(slope_of(Values{1, 1, 1}, Values{1, 2, 3}, Labels{1, 2, 3}), Error);
  EXPECT_THROW(slope_of(Values{1}, Values{1}, Labels{1}), Error);
  EXPECT_THROW(slope_of(Values{1, NAN}, Values{1, 2}, Labels{1, 1}), Error);
  // Each cluster has one level, so some resamples have only one level.
  EXPECT_THROW(slope_of(Values{0.1, 0.2}, Values{1, 2}, Labels{1, 2}), Error);
  const NoiseSlope from_zero = slope_of(Values{0, 1, 0, 1}, Values{0, 2, 0, 3}, Labels{1, 1, 2, 2});
  EXPECT_FALSE(from_zero.relative_slope);
  EXPECT_FALSE(from_zero.relative_interval);
  EXPECT_FALSE(slope_of(Values{0, 1}, Values{1, 2}, Labels{1, 1}).interval);
}

/// p of Page's test by the normal approximation, for blocks without equal values: L has the mean
/// n k (k + 1)^2 / 4 and the variance n k^2 (k + 1) (k^2 - 1) / 144.
double normal_page_p(const std::vector<Values>& blocks) {
  const auto n = static_cast<double>(blocks.size()), k = static_cast<double>(blocks[0].size());
  double L = 0;
  for (const Values& block : blocks) {
    const std::vector<double> ranks = midranks(block);
    for (size_t j = 0; j < ranks.size(); ++j) L += static_cast<double>(j + 1) * ranks[j];
  }
  const double variance = n * k * k * (k + 1) * (k * k - 1) / 144;
  return normal_cdf(-(L - n * k * (k + 1) * (k + 1) / 4) / std::sqrt(variance));
}

// scipy.stats.page_trend_test(blocks, method='exact') and method='asymptotic'.
TEST(PageTrend, AgreesWithScipy) {
  const auto expect = [](const std::vector<Values>& blocks, double exact, double asymptotic) {
    EXPECT_NEAR(page_trend_test(blocks), exact, 1e-12);
    EXPECT_NEAR(normal_page_p(blocks), asymptotic, 1e-12);
  };
  expect({{1, 2, 3, 4}, {2, 1, 4, 3}, {1, 3, 2, 4}, {4, 1, 2, 3}, {1, 2, 4, 3}}, 0.010612079636059668,
         0.01006837577517317);
  expect({{1, 2, 3}, {2, 1, 3}, {3, 1, 2}, {1, 3, 2}, {1, 2, 3}, {2, 3, 1}, {1, 2, 3}, {1, 3, 2}},
         0.052081547210791015, 0.040059156863817086);
  expect({{1, 3, 2, 4, 6, 5}, {2, 1, 3, 5, 4, 6}, {6, 1, 2, 3, 4, 5}, {6, 5, 1, 2, 4, 3}, {1, 2, 6, 3, 5, 4}},
         0.021961604135643124, 0.021250980571409433);
}

TEST(PageTrend, OfTwoLevelsIsTheSignTest) {
  EXPECT_DOUBLE_EQ(page_trend_test(std::vector<Values>(7, {1, 2})), 1. / 128);
  std::vector<Values> blocks(6, {1, 2});
  blocks.push_back({2, 1});
  EXPECT_DOUBLE_EQ(page_trend_test(blocks), 8. / 128);
  blocks.push_back({1, 1});  // the same value in every permutation
  EXPECT_DOUBLE_EQ(page_trend_test(blocks), 8. / 128);
}

TEST(PageTrend, OfTiesCountsAllPermutations) {
  // Blocks (1, 1, 2) and (1, 2, 3): 3 and 6 orders. L is at least 26.5 for 13.5 + 14, 13.5 + 13 (twice), and
  // for no other of the 18 sums, since 12 + 14 = 26.
  EXPECT_DOUBLE_EQ(page_trend_test({{1, 1, 2}, {1, 3, 2}}), 3. / 18);
}

TEST(PageTrend, ExactAndNormalAgreeWhereOneReplacesTheOther) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const auto& [n_levels, most_blocks] : {std::pair(3, 157), {4, 67}, {5, 34}, {6, 20}}) {
    for (const double growth : {0.0, 0.05, 0.1}) {
      std::vector<Values> blocks(static_cast<size_t>(most_blocks));
      for (Values& block : blocks) {
        for (int level = 0; level < n_levels; ++level) block.push_back(growth * level + normal(random));
      }
      const double exact = page_trend_test(blocks), normal_p = normal_page_p(blocks);
      EXPECT_NEAR(exact, normal_p, 0.02) << "the approximation has no continuity correction";
      EXPECT_GT(std::abs(exact / normal_p - 1), 1e-6) << "the exact distribution is used";
      blocks.push_back(blocks.front());
      EXPECT_NEAR(page_trend_test(blocks) / normal_page_p(blocks), 1, 1e-9);
    }
  }
  const std::vector<Values> seven_levels(2, {1, 2, 3, 4, 5, 6, 7});
  EXPECT_NEAR(page_trend_test(seven_levels) / normal_page_p(seven_levels), 1, 1e-9);
}

TEST(PageTrend, TiesAndFallingValues) {
  EXPECT_EQ(page_trend_test({{1, 1, 1}, {2, 2, 2}}), 1);
  EXPECT_GT(page_trend_test({{3, 2, 1}, {3, 2, 1}, {3, 2, 1}, {3, 2, 1}}), 0.99);
  // One block (1, 1, 2) has ranks 1.5 1.5 3; over its 3 permutations L = 13.5, 12, 10.5: variance 1.5. Blocks
  // of equal values add nothing, but their number makes the approximation necessary.
  std::vector<Values> blocks(157, {1, 1, 1});
  EXPECT_EQ(page_trend_test(blocks), 1);
  blocks.push_back({1, 1, 2});
  EXPECT_NEAR(page_trend_test(blocks), normal_cdf(-1.5 / std::sqrt(1.5)), 1e-12);
  EXPECT_EQ(page_trend_test(std::vector<Values>(158, {1, 1, 1})), 1);
  EXPECT_THROW(page_trend_test({}), Error);
  EXPECT_THROW(page_trend_test({{1}}), Error);
  EXPECT_THROW(page_trend_test({{1, 2}, {1, 2, 3}}), Error);
  EXPECT_THROW(page_trend_test({{1, NAN}}), Error);
}

TEST(MinimumDetectableEffect, IsFoundWithTheStatedPower) {
  EXPECT_NEAR(minimum_detectable_effect(1, 100), (1.959963984540054 + 0.8416212335729143) / 10, 1e-12);
  EXPECT_EQ(minimum_detectable_effect(0, 10), 0);
  const double effect = minimum_detectable_effect(1, 60);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(effect, 1);
  int found = 0;
  for (int e = 0; e < 2000; ++e) {
    Values d;
    for (int i = 0; i < 60; ++i) d.push_back(normal(random));
    found += std::abs(mean(d)) > 1.959963984540054 * std_dev(d) / std::sqrt(60);
  }
  EXPECT_NEAR(found / 2000.0, 0.8, 4 * std::sqrt(0.16 / 2000));
  EXPECT_THROW(minimum_detectable_effect(-1, 10), Error);
  EXPECT_THROW(minimum_detectable_effect(1, 1), Error);
  EXPECT_THROW(minimum_detectable_effect(1, 10, 0), Error);
}

// chi2.ppf([.025, .975], 600) / 100.
TEST(NeesInterval, EqualsTheQuantilesOfChiSquare) {
  const Interval interval = nees_interval(100, 6);
  EXPECT_NEAR(interval.low, 5.340185504659327, 1e-8);
  EXPECT_NEAR(interval.high, 6.697691522164112, 1e-8);
  EXPECT_THROW(nees_interval(0, 6), Error);
  EXPECT_THROW(nees_interval(1, 0), Error);
  EXPECT_THROW(nees_interval(1, 6, 1), Error);
}

}  // namespace
}  // namespace sextant
