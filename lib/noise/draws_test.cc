#include "sextant/noise/draws.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/machine.h"

namespace sextant {
namespace {

constexpr auto independent = Correlation::independent;
constexpr auto shared = Correlation::shared_per_frame;

/// All pixels of a 1000 x 1000 image, row by row.
struct MillionPixels {
  std::vector<int> x, y;
  MillionPixels() {
    for (int row = 0; row < 1000; ++row) {
      for (int column = 0; column < 1000; ++column) {
        x.push_back(column);
        y.push_back(row);
      }
    }
  }
  PixelBatch batch(int frame = 0) const { return {frame, x, y}; }
};

struct NormalField {
  std::vector<double> first, second;
};

NormalField field(const Draws& draws, NoiseChannel channel, int frame = 0,
                  Correlation correlation = independent) {
  static const MillionPixels pixels;
  NormalField out{std::vector<double>(pixels.x.size()), std::vector<double>(pixels.x.size())};
  draws.normals(channel, pixels.batch(frame), correlation, out.first, out.second);
  return out;
}

struct Moments {
  double mean = 0, sigma = 0, skewness = 0, kurtosis = 0;
};

Moments moments(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Moments m;
  for (const double v : values) m.mean += v / n;
  double m2 = 0, m3 = 0, m4 = 0;
  for (const double v : values) {
    const double d = v - m.mean;
    m2 += d * d / n;
    m3 += d * d * d / n;
    m4 += d * d * d * d / n;
  }
  m.sigma = std::sqrt(m2);
  m.skewness = m3 / std::pow(m2, 1.5);
  m.kurtosis = m4 / (m2 * m2);
  return m;
}

double correlation_of(const std::vector<double>& a, const std::vector<double>& b) {
  const Moments ma = moments(a);
  const Moments mb = moments(b);
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - ma.mean) * (b[i] - mb.mean);
  return sum / (static_cast<double>(a.size()) * ma.sigma * mb.sigma);
}

TEST(NaturalLog, IsRightToAFewUnitsInTheLastPlace) {
  std::mt19937_64 random(1);
  const auto check = [](double x) {
    const double expected = std::log(x);
    EXPECT_NEAR(internal::natural_log(x), expected, 1e-15 * std::abs(expected)) << x;
  };
  for (int i = 0; i < 100000; ++i) check(unit_interval(static_cast<uint32_t>(random()), 0));
  for (int e = 0; e <= 53; ++e) {
    check(std::ldexp(1.0, -e));
    check(1 - std::ldexp(1.0, -e) + (e == 0 ? 0.5 : 0.0));
  }
  EXPECT_EQ(internal::natural_log(1.0), 0.0);
}

TEST(SineCosineTurns, AreRightToAFewUnitsInTheLastPlace) {
  for (int i = 0; i <= 100000; ++i) {
    const double u = i / 100000.0;
    const internal::SineCosine got = internal::sine_cosine_turns(u);
    // In long double, because 2 pi u itself must not be rounded.
    const long double angle = 2 * std::numbers::pi_v<long double> * u;
    ASSERT_NEAR(got.sine, static_cast<double>(std::sin(angle)), 4e-16) << u;
    ASSERT_NEAR(got.cosine, static_cast<double>(std::cos(angle)), 4e-16) << u;
  }
  for (const auto& [u, s, c] : {std::array{0.0, 0.0, 1.0}, std::array{0.25, 1.0, 0.0},
                                std::array{0.5, 0.0, -1.0}, std::array{0.75, -1.0, 0.0}}) {
    EXPECT_EQ(internal::sine_cosine_turns(u).sine, s);
    EXPECT_EQ(internal::sine_cosine_turns(u).cosine, c);
  }
}

TEST(BoxMuller, IsFiniteAtTheEndsOfTheInterval) {
  for (const double u1 : {0x1p-53, 1.0}) {
    for (const double u2 : {0x1p-53, 0.125, 0.5, 1.0}) {
      const internal::NormalPair n = internal::box_muller(u1, u2);
      EXPECT_TRUE(std::isfinite(n.first) && std::isfinite(n.second)) << u1 << " " << u2;
      EXPECT_LE(std::hypot(n.first, n.second), 8.58);
    }
  }
}

// A million draws: mean within 4 standard errors, sigma within 0.5 %, third and fourth moment of a normal.
TEST(Draws, AMillionNormalsHaveTheMomentsOfANormal) {
  for (const NoiseChannel channel : {NoiseChannel::depth, NoiseChannel::flow, NoiseChannel::backward_flow}) {
    const NormalField normals = field(Draws(1, "vdo", "0003"), channel);
    for (const std::vector<double>* values : {&normals.first, &normals.second}) {
      const Moments m = moments(*values);
      EXPECT_LT(std::abs(m.mean), 4 / std::sqrt(1e6));
      EXPECT_NEAR(m.sigma, 1, 0.005);
      EXPECT_LT(std::abs(m.skewness), 4 * std::sqrt(6 / 1e6));
      EXPECT_NEAR(m.kurtosis, 3, 4 * std::sqrt(24 / 1e6));
    }
    EXPECT_LT(std::abs(correlation_of(normals.first, normals.second)), 0.005);
  }
}

TEST(Draws, TheDistributionIsNormalByKolmogorovAndSmirnov) {
  NormalField normals = field(Draws(2, "vdo", "0003"), NoiseChannel::flow);
  for (std::vector<double>* values : {&normals.first, &normals.second}) {
    std::sort(values->begin(), values->end());
    const auto n = static_cast<double>(values->size());
    double distance = 0;
    for (size_t i = 0; i < values->size(); ++i) {
      const double cdf = 0.5 * std::erfc(-(*values)[i] / std::numbers::sqrt2);
      distance = std::max({distance, cdf - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - cdf});
    }
    EXPECT_LT(distance * std::sqrt(n), 1.95);  // 0.999 quantile of the Kolmogorov distribution
  }
}

TEST(Draws, HorizontalAndVerticalNeighboursAreUncorrelated) {
  const NormalField normals = field(Draws(3, "vdo", "0003"), NoiseChannel::depth);
  for (const int step : {1, 1000}) {
    const std::vector<double> here(normals.first.begin(), normals.first.end() - step);
    const std::vector<double> there(normals.first.begin() + step, normals.first.end());
    EXPECT_LT(std::abs(correlation_of(here, there)), 0.005) << step;
  }
}

TEST(Draws, SharedDrawsAreOneNumberAFrame) {
  const Draws draws(3, "vdo", "0003");
  std::set<double> seen;
  for (int frame = 0; frame < 50; ++frame) {
    const NormalField normals = field(draws, NoiseChannel::flow, frame, shared);
    EXPECT_EQ(std::count(normals.first.begin(), normals.first.end(), normals.first[0]), 1000000);
    EXPECT_EQ(std::count(normals.second.begin(), normals.second.end(), normals.second[0]), 1000000);
    EXPECT_EQ(draws.normals(NoiseChannel::flow, frame, 17, 4, shared)[0], normals.first[0]);
    seen.insert(normals.first[0]);
    seen.insert(normals.second[0]);
  }
  EXPECT_EQ(seen.size(), 100U);
}

TEST(Draws, SharedDrawsAreNormalOverFrames) {
  const Draws draws(3, "vdo", "0003");
  std::vector<double> values;
  for (int frame = 0; frame < 1000000; ++frame) {
    values.push_back(draws.normals(NoiseChannel::depth, frame, 0, 0, shared)[0]);
  }
  const Moments m = moments(values);
  EXPECT_LT(std::abs(m.mean), 4 / std::sqrt(1e6));
  EXPECT_NEAR(m.sigma, 1, 0.005);
}

TEST(Draws, SeedsFramesChannelsAndSequencesAreUncorrelated) {
  const NormalField base = field(Draws(1, "vdo", "0003"), NoiseChannel::depth, 5);
  const std::vector<std::pair<const char*, NormalField>> others = {
      {"seed", field(Draws(2, "vdo", "0003"), NoiseChannel::depth, 5)},
      {"dataset", field(Draws(1, "kitti", "0003"), NoiseChannel::depth, 5)},
      {"sequence", field(Draws(1, "vdo", "0004"), NoiseChannel::depth, 5)},
      {"frame", field(Draws(1, "vdo", "0003"), NoiseChannel::depth, 6)},
      {"channel", field(Draws(1, "vdo", "0003"), NoiseChannel::flow, 5)},
  };
  for (const auto& [what, other] : others) {
    EXPECT_LT(std::abs(correlation_of(base.first, other.first)), 0.005) << what;
  }
}

TEST(Draws, NamesCannotRunIntoEachOther) {
  const auto key = [](const Draws& draws) { return std::pair(draws.key().k0, draws.key().k1); };
  EXPECT_NE(key(Draws(1, "ab", "c")), key(Draws(1, "a", "bc")));
  EXPECT_NE(key(Draws(1, "a\nsequence 1 b", "")), key(Draws(1, "a", "b")));
  EXPECT_EQ(key(Draws(1, "a", "b")), key(Draws(1, "a", "b")));
}

// Property: the numbers do not depend on the requested pixels, their order, batching, or the number of
// threads.
TEST(Draws, DoNotDependOnOrderBatchOrThreads) {
  const Draws draws(9, "synthetic", "s18");
  std::mt19937_64 random(5);
  std::vector<int> x, y;
  for (int i = 0; i < 5000; ++i) {
    x.push_back(static_cast<int>(random() % 1242));
    y.push_back(static_cast<int>(random() % 375));
  }
  std::vector<double> a(x.size()), b(x.size());
  for (const NoiseChannel channel : {NoiseChannel::depth, NoiseChannel::flow}) {
    for (const Correlation correlation : {independent, shared}) {
      draws.normals(channel, {7, x, y}, correlation, a, b);
      for (size_t i = x.size(); i-- > 0;) {  // in reverse order, one by one
        const std::array<double, 2> one = draws.normals(channel, 7, x[i], y[i], correlation);
        ASSERT_EQ(one[0], a[i]);
        ASSERT_EQ(one[1], b[i]);
      }
      for (const int jobs : {1, 2, 7}) {
        std::vector<double> c(x.size()), d(x.size());
        constexpr int pieces = 13;
        parallel_for(pieces, jobs, [&](int piece) {
          const size_t begin = x.size() * piece / pieces;
          const size_t n = x.size() * (piece + 1) / pieces - begin;
          draws.normals(channel, {7, std::span(x).subspan(begin, n), std::span(y).subspan(begin, n)},
                        correlation, std::span(c).subspan(begin, n), std::span(d).subspan(begin, n));
        });
        ASSERT_EQ(a, c);
        ASSERT_EQ(b, d);
      }
    }
  }
  draws.uniforms(NoiseChannel::outlier, {7, x, y}, a, b);
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(draws.uniforms(NoiseChannel::outlier, 7, x[i], y[i])[0], a[i]);
  }
}

// The bits are part of the interface: records of one version must be reproducible by the next.
TEST(Draws, AreTheSameBitsForEver) {
  const Draws draws(42, "vdo", "0003");
  // printf 'sextant noise 1\nseed 42\ndataset 3 vdo\nsequence 4 0003\n' | sha256sum
  EXPECT_EQ(draws.key().k0, 0xdf284932U);
  EXPECT_EQ(draws.key().k1, 0xef51ba79U);
  // An independent implementation (Python, its own Philox, libm) gives -0x1.dd6743eb5c8bap+0
  // 0x1.ea9e24d584800p-4.
  EXPECT_EQ(draws.normals(NoiseChannel::flow, 3, 100, 50)[0], -0x1.dd6743eb5c8bap+0);
  EXPECT_EQ(draws.normals(NoiseChannel::flow, 3, 100, 50)[1], 0x1.ea9e24d5847e7p-4);
}

}  // namespace
}  // namespace sextant
