#include "sextant/stats/clustered_sample.h"

#include <gtest/gtest.h>

#include "sextant/base/philox.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

TEST(ClusteredSample, EqualsTheStatisticOfTheCopiedValues) {
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

TEST(ClusteredSample, IntervalsAreThoseOfTheCopyingBootstrap) {
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

TEST(ClusteredSample, OneClusterHasNoIntervalAndNothingIsRefused) {
  const std::vector<double> values{1, 2, 3};
  const SampleSummary summary = summarize_sample(ClusteredSample(values, std::vector<uint64_t>{5, 5, 5}));
  EXPECT_DOUBLE_EQ(summary.median.value, 2);
  EXPECT_FALSE(summary.mean.interval);
  EXPECT_THROW(ClusteredSample({}, {}), Error);
}

}  // namespace
}  // namespace sextant
