#include "sextant/noise/draws.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "sextant/base/machine.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

/// Components of every kind: spacing 1, odd and even spacings, and an independent remainder.
const NoiseCorrelation mixture(SpatialCorrelation{{{2, 0.2}, {8, 0.3}, {40, 0.4}}});

struct PixelList {
  std::vector<int> x, y;
  void add(int column, int row) {
    x.push_back(column);
    y.push_back(row);
  }
  PixelBatch batch(int frame) const { return {frame, x, y}; }
};

struct Normals {
  std::vector<double> first, second;
};

Normals normals(const NoiseCorrelation& correlation, const Draws& draws, NoiseChannel channel,
                const PixelBatch& pixels) {
  Normals out{std::vector<double>(pixels.size()), std::vector<double>(pixels.size())};
  correlation.normals(draws, channel, pixels, out.first, out.second);
  return out;
}

/// Values of one pixel over many frames, which are independent draws for any field.
std::vector<double> over_frames(const NoiseCorrelation& correlation, const Draws& draws, NoiseChannel channel,
                                int x, int y, int first_frame = 0) {
  constexpr int n = 20000;
  PixelList pixel;
  pixel.add(x, y);
  std::vector<double> values;
  for (int frame = first_frame; frame < first_frame + n; ++frame)
    values.push_back(normals(correlation, draws, channel, pixel.batch(frame)).first[0]);
  return values;
}

double uncentred_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (size_t i = 0; i < a.size(); ++i) ab += a[i] * b[i], aa += a[i] * a[i], bb += b[i] * b[i];
  return ab / std::sqrt(aa * bb);
}

TEST(NoiseCorrelation, EveryPixelIsAStandardNormal) {
  const Draws draws(1, "vdo", "0003");
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(13, 7), std::pair(620, 187), std::pair(-5, 1241)}) {
    std::vector<double> values = over_frames(mixture, draws, NoiseChannel::flow, x, y);
    const auto n = static_cast<double>(values.size());
    double mean = 0, m2 = 0, m3 = 0, m4 = 0;
    for (const double v : values) mean += v / n;
    for (const double v : values) {
      const double d = v - mean;
      m2 += d * d / n, m3 += d * d * d / n, m4 += d * d * d * d / n;
    }
    EXPECT_LT(std::abs(mean), 4 / std::sqrt(n));
    EXPECT_NEAR(m2, 1, 4 * std::sqrt(2 / n));
    EXPECT_LT(std::abs(m3), 4 * std::sqrt(15 / n));
    EXPECT_NEAR(m4 / (m2 * m2), 3, 4 * std::sqrt(24 / n));
    std::sort(values.begin(), values.end());
    double distance = 0;
    for (size_t i = 0; i < values.size(); ++i) {
      const double cdf = 0.5 * std::erfc(-values[i] / std::numbers::sqrt2);
      distance = std::max({distance, cdf - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - cdf});
    }
    // 0.999 quantile of the Kolmogorov distribution
    EXPECT_LT(distance * std::sqrt(n), 1.95) << x << " " << y;
  }
}

// Eight distances in every direction, from pixels of every lattice phase.
TEST(NoiseCorrelation, FallsWithTheDistanceAsAsked) {
  const Draws draws(2, "vdo", "0003");
  constexpr int frames = 100, directions = 6;
  const NoiseCorrelation narrow(SpatialCorrelation{{{1, 1}}});
  for (const NoiseCorrelation* correlation : {&mixture, &narrow}) {
    for (const double r : {1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0}) {
      PixelList here, there;
      double expected = 0;
      for (int x = 0; x < 1000; x += 37) {
        for (int y = 0; y < 1000; y += 39) {
          const double angle = 2 * std::numbers::pi * static_cast<double>(here.x.size()) / directions;
          const int dx = static_cast<int>(std::lround(r * std::cos(angle)));
          const int dy = static_cast<int>(std::lround(r * std::sin(angle)));
          here.add(x, y);
          there.add(x + dx, y + dy);
          expected += correlation->spatial().at(std::hypot(dx, dy));
        }
      }
      expected /= static_cast<double>(here.x.size());
      double ab[2] = {}, aa[2] = {}, bb[2] = {};
      for (int frame = 0; frame < frames; ++frame) {
        const Normals a = normals(*correlation, draws, NoiseChannel::depth, here.batch(frame));
        const Normals b = normals(*correlation, draws, NoiseChannel::depth, there.batch(frame));
        for (size_t i = 0; i < a.first.size(); ++i) {
          ab[0] += a.first[i] * b.first[i], aa[0] += a.first[i] * a.first[i],
              bb[0] += b.first[i] * b.first[i];
          ab[1] += a.second[i] * b.second[i], aa[1] += a.second[i] * a.second[i],
              bb[1] += b.second[i] * b.second[i];
        }
      }
      for (const int k : {0, 1}) EXPECT_NEAR(ab[k] / std::sqrt(aa[k] * bb[k]), expected, 0.02) << r;
    }
  }
}

TEST(NoiseCorrelation, SeedsFramesChannelsAndSequencesAreIndependent) {
  const auto values = [](uint64_t seed, const char* dataset, const char* sequence, NoiseChannel channel,
                         int first_frame) {
    return over_frames(mixture, Draws(seed, dataset, sequence), channel, 100, 50, first_frame);
  };
  const std::vector<double> base = values(1, "vdo", "0003", NoiseChannel::depth, 0);
  EXPECT_LT(std::abs(uncentred_correlation(base, values(2, "vdo", "0003", NoiseChannel::depth, 0))), 0.028);
  EXPECT_LT(std::abs(uncentred_correlation(base, values(1, "kitti", "0003", NoiseChannel::depth, 0))), 0.028);
  EXPECT_LT(std::abs(uncentred_correlation(base, values(1, "vdo", "0004", NoiseChannel::depth, 0))), 0.028);
  EXPECT_LT(std::abs(uncentred_correlation(base, values(1, "vdo", "0003", NoiseChannel::depth, 1))), 0.028);
  for (const NoiseChannel other : {NoiseChannel::flow, NoiseChannel::outlier, NoiseChannel::backward_flow})
    EXPECT_LT(std::abs(uncentred_correlation(base, values(1, "vdo", "0003", other, 0))), 0.028);
}

TEST(NoiseCorrelation, TheTwoNormalsOfAPixelAreIndependent) {
  PixelList pixel;
  pixel.add(31, 77);
  std::vector<double> first, second;
  for (int frame = 0; frame < 20000; ++frame) {
    const Normals n = normals(mixture, Draws(1, "a", "b"), NoiseChannel::flow, pixel.batch(frame));
    first.push_back(n.first[0]);
    second.push_back(n.second[0]);
  }
  EXPECT_LT(std::abs(uncentred_correlation(first, second)), 0.028);
}

// Property: the numbers do not depend on the requested pixels, their order, batching, or the number of
// threads.
TEST(NoiseCorrelation, DoesNotDependOnOrderBatchOrThreads) {
  const Draws draws(9, "synthetic", "s18");
  std::mt19937_64 random(5);
  PixelList pixels;
  for (int i = 0; i < 3000; ++i) {
    pixels.add(static_cast<int>(random() % 1242), static_cast<int>(random() % 375));
  }
  pixels.add(-3, -700);  // outside the image, which needs no special treatment
  pixels.add(100000, 7);
  const size_t n = pixels.x.size();
  const Normals all = normals(mixture, draws, NoiseChannel::flow, pixels.batch(7));
  for (size_t i = n; i-- > 0;) {
    PixelList one;
    one.add(pixels.x[i], pixels.y[i]);
    const Normals alone = normals(mixture, draws, NoiseChannel::flow, one.batch(7));
    ASSERT_EQ(alone.first[0], all.first[i]);
    ASSERT_EQ(alone.second[0], all.second[i]);
  }
  for (const int jobs : {1, 2, 7}) {
    Normals parts{std::vector<double>(n), std::vector<double>(n)};
    constexpr int pieces = 13;
    parallel_for(pieces, jobs, [&](int piece) {
      const size_t begin = n * piece / pieces;
      const size_t size = n * (piece + 1) / pieces - begin;
      mixture.normals(draws, NoiseChannel::flow,
                      {7, std::span(pixels.x).subspan(begin, size), std::span(pixels.y).subspan(begin, size)},
                      std::span(parts.first).subspan(begin, size),
                      std::span(parts.second).subspan(begin, size));
    });
    ASSERT_EQ(parts.first, all.first);
    ASSERT_EQ(parts.second, all.second);
  }
  const std::vector<int> none;
  mixture.normals(draws, NoiseChannel::flow, {7, none, none}, {}, {});
}

// The bits are part of the interface: records of one version must be reproducible by the next.
TEST(NoiseCorrelation, IsReproducibleBitForBit) {
  const Draws draws(42, "vdo", "0003");
  PixelList pixel;
  pixel.add(100, 50);
  const Normals n = normals(mixture, draws, NoiseChannel::flow, pixel.batch(3));
  // An independent implementation (Python: Philox, libm, the sum over nodes as in the header) gives
  // 0x1.763786cde472ap-1 -0x1.f87ec6b51fbf5p-1.
  EXPECT_EQ(n.first[0], 0x1.763786cde4598p-1);
  EXPECT_EQ(n.second[0], -0x1.f87ec6b51fc04p-1);
}

TEST(NoiseCorrelation, ReadsAndWritesItsOptions) {
  const Json json = Json::parse(R"({"model": "spatial", "lengths_px": [5, 40], "shares": [0.4, 0.5]})");
  const NoiseCorrelation read = NoiseCorrelation::read(json, "noise.correlation");
  EXPECT_EQ(read.json(), json);
  EXPECT_EQ(read.name(), " (spatial 5, 40 px)");
  EXPECT_FALSE(read.independent());
  EXPECT_DOUBLE_EQ(read.spatial().independent_share(), 0.1);
  EXPECT_DOUBLE_EQ(read.spatial().at(0), 1);
  EXPECT_DOUBLE_EQ(read.spatial().at(5), 0.4 * std::exp(-0.5) + 0.5 * std::exp(-25.0 / 3200));
  for (const char* name : {"independent", "shared_per_frame"})
    EXPECT_EQ(NoiseCorrelation::read(name, "").json(), name);
}

TEST(NoiseCorrelation, RefusesInvalidCorrelations) {
  const auto message = [](const char* text) {
    return error_of([&] { NoiseCorrelation::read(Json::parse(text), "noise.correlation"); });
  };
  EXPECT_THAT(message("3"), HasSubstr("noise.correlation: expected independent"));
  EXPECT_THAT(message(R"("spatial")"),
              HasSubstr("expected independent, shared_per_frame or an object such as"));
  EXPECT_THAT(message(R"({})"), HasSubstr("'model' is missing"));
  EXPECT_THAT(message(R"({"model": "temporal"})"), HasSubstr("must be spatial"));
  EXPECT_THAT(message(R"({"model": "spatial", "length_px": [5]})"), HasSubstr("did you mean 'lengths_px'"));
  EXPECT_THAT(message(R"({"model": "spatial"})"), HasSubstr("their number = 0"));
  EXPECT_THAT(message(R"({"model": "spatial", "lengths_px": [5], "shares": []})"), HasSubstr("0 shares"));
  EXPECT_THAT(message(R"({"model": "spatial", "lengths_px": ["a"], "shares": [1]})"),
              HasSubstr("lengths_px"));
  EXPECT_THAT(message(R"({"model": "spatial", "lengths_px": 5, "shares": [1]})"), HasSubstr("lengths_px"));
  EXPECT_THAT(message(R"({"model": "spatial", "lengths_px": [0.5], "shares": [1]})"), HasSubstr("[1, 1000]"));
  EXPECT_THAT(message(R"({"model": "spatial", "lengths_px": [5], "shares": [0]})"), HasSubstr("> 0"));
  EXPECT_THAT(message(R"({"model": "spatial", "lengths_px": [5, 6], "shares": [0.6, 0.6]})"),
              HasSubstr("at most 1"));
}

}  // namespace
}  // namespace sextant
