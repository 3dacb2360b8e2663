#include "sextant/estimator/points/fast_corners.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

constexpr int radius = 3;
constexpr int block = 32;
using Bytes = uint8_t __attribute__((vector_size(block)));
using UnalignedBytes = uint8_t __attribute__((vector_size(block), aligned(1), may_alias));
using Words = uint64_t __attribute__((vector_size(block)));

struct Offset {
  int x, y;
};
constexpr std::array<Offset, 16> circle = {{{0, -3},
                                            {1, -3},
                                            {2, -2},
                                            {3, -1},
                                            {3, 0},
                                            {3, 1},
                                            {2, 2},
                                            {1, 3},
                                            {0, 3},
                                            {-1, 3},
                                            {-2, 2},
                                            {-3, 1},
                                            {-3, 0},
                                            {-3, -1},
                                            {-2, -2},
                                            {-1, -3}}};

// Macros as in lanes.h: functions of vectors would differ in calling convention between the clones.
#define SEXTANT_MIN(a, b) ((a) < (b) ? (a) : (b))
#define SEXTANT_MAX(a, b) ((a) > (b) ? (a) : (b))

/// Responses of the pixels centre[0 .. n), 0 where there is no corner. Reads and writes whole blocks.
SEXTANT_SIMD void score_row(const uint8_t* centre, std::ptrdiff_t stride, int n, int threshold,
                            uint8_t* scores) {
  const Bytes t = Bytes{} + static_cast<uint8_t>(threshold);
  std::array<std::ptrdiff_t, 16> offset;
  for (size_t k = 0; k < 16; ++k) offset[k] = circle[k].y * stride + circle[k].x;
  for (int x = 0; x < n; x += block) {
    const auto load = [&](size_t k) {
      return reinterpret_cast<const UnalignedBytes*>(centre + x + offset[k]);
    };
    const Bytes c = *reinterpret_cast<const UnalignedBytes*>(centre + x);
    auto* out = reinterpret_cast<UnalignedBytes*>(scores + x);
    *out = Bytes{};
    const Bytes high = SEXTANT_MAX(c, ~t) == c ? ~Bytes{} : c + t;  // saturated
    const Bytes low = SEXTANT_MAX(c, t) - t;
    // Nine in a row hold two adjacent ones of the four at the top, right, bottom and left.
    const Bytes top = *load(0), right = *load(4), bottom = *load(8), left = *load(12);
    const Bytes bright4 = SEXTANT_MIN(SEXTANT_MAX(top, bottom), SEXTANT_MAX(right, left));
    const Bytes dark4 = SEXTANT_MAX(SEXTANT_MIN(top, bottom), SEXTANT_MIN(right, left));
    const Words any =
        reinterpret_cast<Words>((SEXTANT_MAX(bright4, high) - high) | (SEXTANT_MAX(low, dark4) - dark4));
    if ((any[0] | any[1] | any[2] | any[3]) == 0) continue;

    // Two arcs of nine share the eight from an even pixel on: that of the pixel before them, that of the one
    // after. Brightness of an arc: its darkest pixel.
    Bytes p[16];
    for (size_t k = 0; k < 16; ++k) p[k] = *load(k);
    Bytes min2[8], max2[8];
    for (size_t k = 0; k < 8; ++k) {
      min2[k] = SEXTANT_MIN(p[2 * k], p[2 * k + 1]);
      max2[k] = SEXTANT_MAX(p[2 * k], p[2 * k + 1]);
    }
    Bytes min4[8], max4[8];
    for (size_t k = 0; k < 8; ++k) {
      min4[k] = SEXTANT_MIN(min2[k], min2[(k + 1) % 8]);
      max4[k] = SEXTANT_MAX(max2[k], max2[(k + 1) % 8]);
    }
    Bytes brightest = {};
    Bytes darkest = ~Bytes{};
    for (size_t k = 0; k < 8; ++k) {
      const Bytes before = p[(2 * k + 15) % 16];
      const Bytes after = p[(2 * k + 8) % 16];
      const Bytes min8 = SEXTANT_MIN(min4[k], min4[(k + 2) % 8]);
      const Bytes max8 = SEXTANT_MAX(max4[k], max4[(k + 2) % 8]);
      const Bytes outer_max = SEXTANT_MAX(before, after);
      const Bytes outer_min = SEXTANT_MIN(before, after);
      const Bytes min9 = SEXTANT_MIN(min8, outer_max);
      const Bytes max9 = SEXTANT_MAX(max8, outer_min);
      brightest = SEXTANT_MAX(brightest, min9);
      darkest = SEXTANT_MIN(darkest, max9);
    }
    const Bytes bright = SEXTANT_MAX(brightest, c) - c;
    const Bytes dark = c - SEXTANT_MIN(darkest, c);
    const Bytes contrast = SEXTANT_MAX(bright, dark);
    *out = contrast > t ? contrast - 1 : Bytes{};
  }
}

/// The scores row[0 .. n) that beat their 8 neighbours, else 0. Writes whole blocks.
SEXTANT_SIMD void keep_maxima(const uint8_t* above, const uint8_t* row, const uint8_t* below, int n,
                              uint8_t* maxima) {
  for (int x = 0; x < n; x += block) {
    const auto load = [&](const uint8_t* scores) {
      return reinterpret_cast<const UnalignedBytes*>(scores + x);
    };
    const Bytes score = *load(row);
    Bytes strongest = *load(row - 1);
    for (const uint8_t* other :
         {row + 1, above - 1, above, above + 1, below - 1, below, static_cast<const uint8_t*>(below + 1)}) {
      const Bytes neighbour = *load(other);
      strongest = SEXTANT_MAX(strongest, neighbour);
    }
    *reinterpret_cast<UnalignedBytes*>(maxima + x) = score > strongest ? score : Bytes{};
  }
}

void append_nonzero(const uint8_t* row, int n, int y, std::vector<Feature>& corners) {
  for (int x = 0; x < n; x += 8) {
    uint64_t eight = 0;
    std::memcpy(&eight, row + x, sizeof(eight));
    while (eight != 0) {
      const int k = std::countr_zero(eight) / 8;
      if (x + k >= n) break;
      corners.push_back({x + k + radius, y, row[x + k]});
      eight &= ~(uint64_t{0xff} << (8 * k));
    }
  }
}

}  // namespace

std::vector<Feature> fast_corners(const Image<uint8_t>& gray, int threshold) {
  SEXTANT_CHECK(threshold > 0 && threshold < 255);
  std::vector<Feature> corners;
  const int width = gray.width() - 2 * radius;
  if (width <= 0 || gray.height() <= 2 * radius) return corners;
  // A block may reach beyond the last pixel of the image.
  std::vector<uint8_t> pixels(gray.size() + block);
  std::copy_n(gray.data(), gray.size(), pixels.begin());
  // Three rows of scores with a margin on both sides, used in turn.
  const size_t length = static_cast<size_t>(width) + 2 * block;
  std::vector<uint8_t> scores(3 * length);
  std::vector<uint8_t> maxima(length);
  const auto row = [&](int y) { return scores.data() + static_cast<size_t>(y % 3) * length + block; };
  for (int y = radius; y <= gray.height() - radius; ++y) {
    if (y < gray.height() - radius) {
      score_row(pixels.data() + static_cast<size_t>(y) * gray.width() + radius, gray.width(), width,
                threshold, row(y));
    } else {
      std::fill_n(row(y), width, uint8_t{0});
    }
    std::fill_n(row(y) + width, block - 1, uint8_t{0});
    keep_maxima(row(y - 2), row(y - 1), row(y), width, maxima.data());
    append_nonzero(maxima.data(), width, y - 1, corners);
  }
  return corners;
}

}  // namespace sextant
