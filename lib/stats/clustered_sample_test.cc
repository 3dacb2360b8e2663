#include <gtest/gtest.h>
#include <cmath>

#include "sextant/base/philox.h"
#include "sextant/stats/clustered_sample.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/testing.h"

namespace sextant {
namespace {

TEST(ClusteredSample, EqualsTheStatisticOfTheConcatenatedValues) {
  PhiloxStream random(3, 0);
  for (int trial = 0; trial < 200; ++trial) {
    const size_t n = 1 + random.below(40);
    std::vector<double> values;
    std::vector<uint64_t> label;
    for (size_t i = 0; i < n; ++i) {
      values.push_back(static_cast<double>(random.below(12)) / 4 - 1);  // with ties
      label.push_back(7 * random.below(6));
    }
    const ClusteredSample sample(values, label);
    const auto members = members_of_clusters(label);
    ASSERT_EQ(sample.n_clusters(), members.size());
    std::vector<size_t> chosen;
    for (size_t i = 0; i < members.size(); ++i) chosen.push_back(random.below(members.size()));
    std::vector<double> copied;
    for (const size_t c : chosen) {
      for (const size_t i : members[c]) copied.push_back(values[i]);
    }
    EXPECT_NEAR(sample.mean(chosen), mean(copied), 1e-12);
    EXPECT_NEAR(sample.rmse(chosen), rmse(copied), 1e-12);
    for (const double p : {0.0, 0.05, 0.25, 0.5, 0.77, 0.95, 1.0}) {
      EXPECT_NEAR(sample.quantile(chosen, p), quantile(copied, p), 1e-12) << "p " << p;
    }
  }
}

TEST(ClusteredSample, IntervalsEqualThoseOfTheGenericBootstrap) {
  PhiloxStream random(4, 0);
  std::vector<double> values;
  std::vector<uint64_t> label;
  for (uint64_t c = 0; c < 15; ++c) {
    for (int i = 0; i < 7; ++i) {
      values.push_back(static_cast<double>(random.below(1000)) + 100.0 * static_cast<double>(c));
      label.push_back(c);
    }
  }
  const SampleSummary summary = summarize_sample(ClusteredSample(values, label));
  const auto expect_equal = [](const Interval& a, const Interval& b) {
    EXPECT_NEAR(a.low, b.low, 1e-9);
    EXPECT_NEAR(a.high, b.high, 1e-9);
  };
  expect_equal(*summary.mean.interval, *bootstrap_by_cluster(values, label, mean));
  expect_equal(*summary.rmse.interval, *bootstrap_by_cluster(values, label, rmse));
  expect_equal(*summary.median.interval, *bootstrap_by_cluster(values, label, median));
  expect_equal(*summary.q95.interval, *bootstrap_by_cluster(values, label, [](std::span<const double> v) {
    return quantile(v, 0.95);
  }));
  EXPECT_DOUBLE_EQ(summary.q25.value, quantile(values, 0.25));
}

/// Large samples, whose quantiles are found through the table of stretches.
TEST(ClusteredSample, QuantilesOfLargeSamplesAreExact) {
  PhiloxStream random(5, 0);
  std::vector<double> values;
  std::vector<uint64_t> label;
  for (uint64_t c = 0; c < 300; ++c) {
    for (uint64_t i = random.below(80); i > 0; --i) {
      values.push_back(static_cast<double>(random.below(5000)) +
                       (c % 7 == 0 ? 2000 : 0));  // ties, and clusters far apart
      label.push_back(c);
    }
  }
  const ClusteredSample sample(values, label);
  const auto members = members_of_clusters(label);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<size_t> chosen;
    for (size_t i = 0; i < members.size(); ++i)
      chosen.push_back(random.below(trial < 10 ? members.size() : 9));
    std::vector<double> copied;
    for (const size_t c : chosen) {
      for (const size_t i : members[c]) copied.push_back(values[i]);
    }
    for (const double p : {0.0, 0.05, 0.25, 0.5, 0.77, 0.95, 1.0})
      EXPECT_EQ(sample.quantile(chosen, p), quantile(copied, p)) << "p " << p;
  }
}

/// More clusters than max_clusters: the interval over groups of neighbours is as wide as that over all
/// clusters.
TEST(ClusteredSample, JoinsClustersBeyondTheLargestNumber) {
  PhiloxStream random(6, 0);
  constexpr uint64_t n_clusters = 3 * max_clusters;
  std::vector<double> values;
  std::vector<uint64_t> label;
  for (uint64_t c = 0; c < n_clusters; ++c) {
    const double common = random.uniform();
    for (int i = 0; i < 3; ++i) {
      values.push_back(common + 0.1 * random.uniform());
      label.push_back(10 * c);
    }
  }
  const ClusteredSample sample(values, label);
  EXPECT_EQ(sample.n_clusters(), max_clusters);
  const IntervalEstimate mean_of = summarize_sample(sample).mean;
  EXPECT_NEAR(mean_of.value, mean(values), 1e-12);
  // A cluster mean has the variance (1 + 0.01 / 3) / 12.
  const double half_width = 1.96 * std::sqrt((1 + 0.01 / 3) / 12 / static_cast<double>(n_clusters));
  EXPECT_NEAR((mean_of.interval->high - mean_of.interval->low) / (2 * half_width), 1, 0.1);
}

TEST(ClusteredSample, TakesSumsFromElsewhere) {
  const std::vector<double> rounded{1, 2, 4};
  const std::vector<uint64_t> label{3, 3, 9};
  const ClusteredSample sample({{3, {2, 3.1, 5.2}}, {9, {1, 4.2, 17.6}}}, rounded, label);
  const std::vector<size_t> both{0, 1};
  EXPECT_DOUBLE_EQ(sample.mean(both), 7.3 / 3);
  EXPECT_DOUBLE_EQ(sample.rmse(both), std::sqrt(22.8 / 3));
  EXPECT_DOUBLE_EQ(sample.quantile(both, 0.5), 2);
}

TEST(ClusteredSample, OneClusterHasNoIntervalAndAnEmptySampleIsRefused) {
  const std::vector<double> values{1, 2, 3};
  const SampleSummary summary = summarize_sample(ClusteredSample(values, std::vector<uint64_t>{5, 5, 5}));
  EXPECT_DOUBLE_EQ(summary.median.value, 2);
  EXPECT_FALSE(summary.mean.interval);
  EXPECT_THROW(ClusteredSample({}, {}), Error);
}

}  // namespace

}  // namespace sextant
