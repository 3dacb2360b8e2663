#include "sextant/stats/bootstrap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sextant/base/philox.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/testing.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

std::vector<double> normals(int n, unsigned seed, double mean_value = 0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(mean_value, 1);
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(normal(random));
  return values;
}

TEST(Bootstrap, AgreesWithTheNormalIntervalOfAMean) {
  const std::vector<double> values = normals(400, 3);
  const double half = normal_quantile(0.975) * std_dev(values) / std::sqrt(400);
  for (const BootstrapMethod method : {BootstrapMethod::bca, BootstrapMethod::percentile}) {
    const auto interval = bootstrap(values, mean, {.replicates = 10000, .method = method});
    ASSERT_TRUE(interval);
    EXPECT_NEAR(interval->low, mean(values) - half, 0.08 * half) << to_string(method);
    EXPECT_NEAR(interval->high, mean(values) + half, 0.08 * half) << to_string(method);
  }
}

TEST(Bootstrap, IsAPureFunctionOfDataAndSeed) {
  const std::vector<double> values = normals(30, 4);
  const auto a = bootstrap(values, median, {.seed = 5});
  const auto b = bootstrap(values, median, {.seed = 5});
  const auto c = bootstrap(values, median, {.seed = 6});
  EXPECT_EQ(a->low, b->low);
  EXPECT_EQ(a->high, b->high);
  const auto d = bootstrap(values, mean, {.seed = 5});
  const auto e = bootstrap(values, mean, {.seed = 6});
  EXPECT_NE(d->low, e->low);
  EXPECT_NEAR(a->low, c->low, 0.2);
}

TEST(Bootstrap, ResampleRIsDrawnFromStreamR) {
  for (const size_t n_clusters : {size_t{2}, size_t{7}, size_t{2000}, size_t{70001}}) {
    const BootstrapOptions options{
        .replicates = 100, .method = BootstrapMethod::percentile, .seed = 0x123456789};
    uint64_t resample = 0;
    cluster_bootstrap(
        n_clusters,
        [&](std::span<const size_t> clusters) {
          PhiloxStream random(options.seed, resample++);
          EXPECT_EQ(clusters.size(), n_clusters);
          for (const size_t cluster : clusters) {
            EXPECT_EQ(cluster, random.below(n_clusters));
          }
          return 1.0;
        },
        options);
    EXPECT_EQ(resample, 100U);
  }
}

TEST(Bootstrap, BcaFollowsTheSkewnessThatPercentileMisses) {
  std::vector<double> values;
  for (const double x : normals(60, 5)) values.push_back(std::exp(x));
  const auto bca = bootstrap(values, mean, {.replicates = 5000});
  const auto percentile =
      bootstrap(values, mean, {.replicates = 5000, .method = BootstrapMethod::percentile});
  EXPECT_GT(bca->high, percentile->high);
  EXPECT_GT(bca->low, percentile->low);
}

TEST(Bootstrap, HasZeroWidthForEqualValues) {
  const auto interval = bootstrap(std::vector<double>(10, 3.5), mean);
  EXPECT_EQ(interval->low, 3.5);
  EXPECT_EQ(interval->high, 3.5);
}

TEST(Bootstrap, HasNoIntervalForOneCluster) {
  EXPECT_FALSE(bootstrap(std::vector<double>{3}, mean));
  EXPECT_FALSE(bootstrap_by_cluster(std::vector<double>{1, 2, 3}, std::vector<uint64_t>{7, 7, 7}, mean));
  EXPECT_TRUE(bootstrap_by_cluster(std::vector<double>{1, 2, 3}, std::vector<uint64_t>{7, 7, 8}, mean));
}

TEST(Bootstrap, RefusesBadInput) {
  EXPECT_THROW(bootstrap(std::vector<double>{}, mean), Error);
  EXPECT_THROW(bootstrap(std::vector<double>{1, NAN}, mean), Error);
  EXPECT_THROW(bootstrap(std::vector<double>{1, 2}, mean, {.replicates = 10}), Error);
  EXPECT_THROW(bootstrap(std::vector<double>{1, 2}, mean, {.confidence = 1}), Error);
  EXPECT_THROW(bootstrap(std::vector<double>{1, 2}, [](std::span<const double>) { return NAN; }), Error);
  EXPECT_THROW(bootstrap_by_cluster(std::vector<double>{1, 2}, std::vector<uint64_t>{1}, mean),
               InternalError);
}

// Coverage probability of an interval, from 800 experiments; for 95 % its standard error is 0.8 %.
double coverage(const std::function<std::optional<Interval>(unsigned experiment)>& interval) {
  int hits = 0;
  constexpr int experiments = 800;
  for (int i = 0; i < experiments; ++i) {
    const auto result = interval(static_cast<unsigned>(i) + 100);
    hits += result->low <= 0 && 0 <= result->high;
  }
  return static_cast<double>(hits) / experiments;
}

TEST(Bootstrap, CoversTheTrueMean) {
  for (const BootstrapMethod method : {BootstrapMethod::bca, BootstrapMethod::percentile}) {
    const double share = coverage([&](unsigned seed) {
      return bootstrap(normals(60, seed), mean, {.replicates = 600, .method = method});
    });
    EXPECT_GE(share, 0.93) << to_string(method);
    EXPECT_LE(share, 0.97) << to_string(method);
  }
}

/// Lengths of n normal 3-vectors, such as E_t, less their true mean.
std::vector<double> centred_lengths(int n, unsigned seed) {
  const std::vector<double> x = normals(3 * n, seed);
  std::vector<double> lengths(static_cast<size_t>(n));
  for (size_t i = 0; i < lengths.size(); ++i)
    lengths[i] = std::hypot(x[3 * i], x[3 * i + 1], x[3 * i + 2]) - std::sqrt(8 / std::numbers::pi);
  return lengths;
}

TEST(Bootstrap, CoverageIsRightFromTenClustersOn) {
  for (const int n : {5, 10, 20, 60}) {
    for (const BootstrapMethod method : {BootstrapMethod::percentile, BootstrapMethod::bca}) {
      const BootstrapOptions options{.replicates = 600, .method = method};
      const double normal =
          coverage([&](unsigned seed) { return bootstrap(normals(n, seed), mean, options); });
      const double length =
          coverage([&](unsigned seed) { return bootstrap(centred_lengths(n, seed), mean, options); });
      fmt::print("{} clusters, {}: {:.1f} % for normal values, {:.1f} % for lengths\n", n, to_string(method),
                 100 * normal, 100 * length);
      EXPECT_GE(std::min(normal, length), n < 10 ? 0.86 : 0.92);
      EXPECT_LE(std::max(normal, length), 0.975);
    }
  }
}

/// 60 seeds with 5 frames each; each seed shifts all its frames.
struct DrawnClusters {
  std::vector<double> values;
  std::vector<uint64_t> cluster;
  explicit DrawnClusters(unsigned seed) {
    const std::vector<double> shift = normals(60, seed);
    const std::vector<double> noise = normals(300, seed + 100000);
    for (size_t i = 0; i < noise.size(); ++i) {
      values.push_back(shift[i / 5] + 0.5 * noise[i]);
      cluster.push_back(i / 5);
    }
  }
};

TEST(Bootstrap, ByClusterCoversWhereSingleValuesDoNot) {
  const double by_cluster = coverage([](unsigned seed) {
    const DrawnClusters sample(seed);
    return bootstrap_by_cluster(sample.values, sample.cluster, mean,
                                {.replicates = 400, .method = BootstrapMethod::percentile});
  });
  EXPECT_GE(by_cluster, 0.93);
  EXPECT_LE(by_cluster, 0.97);
  const double naive = coverage([](unsigned seed) {
    return bootstrap(DrawnClusters(seed).values, mean,
                     {.replicates = 400, .method = BootstrapMethod::percentile});
  });
  EXPECT_LT(naive, 0.75);
}

}  // namespace
}  // namespace sextant
