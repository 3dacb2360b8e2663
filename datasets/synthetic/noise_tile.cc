#include "sextant/datasets/synthetic/noise_tile.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {
namespace {

constexpr float range = 4.0F;
constexpr int tile_side = NoiseTile::tile_side;

/// A level of the tile: side texels each way.
struct Level {
  int side = 0;
  std::vector<float> values;
  float operator()(int x, int y) const { return values[static_cast<size_t>(y % side) * side + x % side]; }
};

Level octaves(int finest, int coarsest, unsigned seed) {
  Level level{tile_side, std::vector<float>(static_cast<size_t>(tile_side) * tile_side)};
  for (int cell = finest; cell <= coarsest; cell *= 2) {
    const int n = tile_side / cell;
    const auto value = [&](int i, int j) {
      const uint32_t h = hash3(static_cast<uint32_t>(i % n), static_cast<uint32_t>(j % n), seed * 64 + cell);
      return static_cast<float>(h) * 0x1p-31F - 1.0F;
    };
    for (int y = 0; y < tile_side; ++y) {
      for (int x = 0; x < tile_side; ++x) {
        float a = static_cast<float>(x % cell) / static_cast<float>(cell);
        float b = static_cast<float>(y % cell) / static_cast<float>(cell);
        a = a * a * (3 - 2 * a);
        b = b * b * (3 - 2 * b);
        const int i = x / cell, j = y / cell;
        const float upper = value(i, j) * (1 - a) + value(i + 1, j) * a;
        const float lower = value(i, j + 1) * (1 - a) + value(i + 1, j + 1) * a;
        level.values[static_cast<size_t>(y) * tile_side + x] += upper * (1 - b) + lower * b;
      }
    }
  }
  return level;
}

Level halved(const Level& finer) {
  Level level{finer.side / 2, {}};
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      const int i = 2 * x, j = 2 * y;
      level.values.push_back((finer(i, j) + finer(i + 1, j) + finer(i, j + 1) + finer(i + 1, j + 1)) / 4);
    }
  }
  return level;
}

/// Where bilinear look-ups of both levels fall: words of the corners, and shares between them.
struct Places {
  alignas(32) int32_t index[2][NoiseTile::batch];
  alignas(32) uint32_t word[2][NoiseTile::batch];
  alignas(32) float a[2][NoiseTile::batch];
  alignas(32) float b[2][NoiseTile::batch];
  alignas(32) float part[NoiseTile::batch];  ///< of the coarser level
};

SEXTANT_INLINED void place(Places& p, int which, int i, float x, float y, int32_t level) {
  // Levels follow each other: 0, 65536, 65536 + 16384, ...
  constexpr int32_t all_channels = 0x15555;
  const int32_t first = all_channels - (all_channels >> 2 * level), mask = (tile_side - 1) >> level;
  const auto scale = std::bit_cast<float>((127 - level) << 23);
  const float offset = 0.5F * scale - 0.5F;  // texel centres of a level lie between those of the one below
  const float at_x = x * scale + offset, at_y = y * scale + offset;
  const int32_t ix = wide::floor_int(at_x), iy = wide::floor_int(at_y);
  p.index[which][i] = first + ((iy & mask) * (mask + 1)) + (ix & mask);
  p.a[which][i] = at_x - static_cast<float>(ix);
  p.b[which][i] = at_y - static_cast<float>(iy);
}

SEXTANT_SIMD void find(const float* __restrict x, const float* __restrict y, const float* __restrict width,
                       int n, Places& p) {
  for (int i = 0; i < n; ++i) {
    // The logarithm to base 2, linear between powers of two: enough to choose a level smoothly.
    const auto bits = std::bit_cast<int32_t>(wide::max(width[i], 1.0F));
    const float level = wide::min(static_cast<float>(bits) * 0x1p-23F - 127.0F, NoiseTile::levels - 1.001F);
    const auto low = static_cast<int32_t>(level);
    p.part[i] = level - static_cast<float>(low);
    place(p, 0, i, x[i], y[i], low);
    place(p, 1, i, x[i], y[i], low + 1);
  }
}

SEXTANT_INLINED float blend(uint32_t word, float a, float b) {
  const auto corner = [&](int shift) {
    return static_cast<float>(static_cast<int32_t>(word >> shift & 255U));
  };
  const float upper = wide::mix(corner(0), corner(8), a);
  const float lower = wide::mix(corner(16), corner(24), a);
  return wide::mix(upper, lower, b);
}

SEXTANT_SIMD void blend_all(const Places& p, const float* __restrict weight, int n, float* __restrict sum) {
  for (int i = 0; i < n; ++i) {
    const float fine = blend(p.word[0][i], p.a[0][i], p.b[0][i]);
    const float coarse = blend(p.word[1][i], p.a[1][i], p.b[1][i]);
    sum[i] += weight[i] * (wide::mix(fine, coarse, p.part[i]) - 127.5F) * (range / 127.5F);
  }
}

}  // namespace

NoiseTile::NoiseTile(int finest, int coarsest, unsigned seed) {
  Level level = octaves(finest, coarsest, seed);
  const auto byte = [&](int x, int y) {
    return static_cast<uint32_t>(std::lround(std::clamp(level(x, y) / range, -1.0F, 1.0F) * 127.5F + 127.5F));
  };
  for (int i = 0; i < levels; ++i) {
    for (int y = 0; y < level.side; ++y) {
      for (int x = 0; x < level.side; ++x) {
        corners_.push_back(byte(x, y) | byte(x + 1, y) << 8 | byte(x, y + 1) << 16 |
                           byte(x + 1, y + 1) << 24);
      }
    }
    level = halved(level);
  }
}

void NoiseTile::add_means(const float* x, const float* y, const float* width, const float* weight, int n,
                          float* sum) const {
  SEXTANT_CHECK(n <= batch);
  const int whole = wide::whole(n);
  Places p;
  find(x, y, width, whole, p);
  for (int which = 0; which < 2; ++which) {
    for (int i = 0; i < whole; ++i) p.word[which][i] = corners_[p.index[which][i]];
  }
  blend_all(p, weight, whole, sum);
}

}  // namespace sextant::synthetic
