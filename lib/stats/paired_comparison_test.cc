#include "sextant/stats/paired_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

using Values = std::vector<double>;
using Labels = std::vector<uint64_t>;

TEST(PairedComparison, SeesWhatPairingRemoves) {
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

TEST(PairedComparison, TestsTheMeansOfTheClusters) {
  const Values differences = {1, 3, -2, 0, 4, 4, 1, -1};
  const Labels seeds = {7, 7, 2, 2, 9, 9, 5, 5};  // means, by label: -1, 0, 2, 4
  const Values means = {-1, 0, 2, 4};
  const PairedComparison ranks = compare_pairs(differences, seeds);
  EXPECT_EQ(ranks.n_clusters, 4);
  EXPECT_EQ(ranks.n_used, 3);
  EXPECT_EQ(ranks.difference, 1.25);
  EXPECT_EQ(*ranks.p, wilcoxon_test(means).p);
  EXPECT_EQ(*ranks.detectable, minimum_detectable_effect(std_dev(means), 4));
  const auto interval = bootstrap_by_cluster(differences, seeds, mean);
  EXPECT_EQ(ranks.interval->low, interval->low);
  EXPECT_EQ(ranks.interval->high, interval->high);
  EXPECT_EQ(*compare_pairs(differences, seeds, {}, PairedTest::sign_flip).p, sign_flip_test(means).p);
}

TEST(PairedComparison, SaysNothingOfTheSpreadOfOneCluster) {
  const PairedComparison c = compare_pairs(Values{1, 2}, Labels{3, 3});
  EXPECT_FALSE(c.interval || c.detectable);
  EXPECT_EQ(*c.p, 1);
  EXPECT_THROW(compare_pairs(Values{}), Error);
  EXPECT_THROW(compare_pairs(Values{NAN, 1}), Error);
  EXPECT_THROW(compare_pairs(Values{1, 2}, Labels{1}), InternalError);
}

TEST(PairedComparison, HolmCorrectsThoseOfAFamilyThatHaveAP) {
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
