#include "sextant/datasets/synthetic/noise_tile.h"

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

NoiseTile::NoiseTile(int finest, int coarsest, unsigned seed) {
  values_.assign(kSide * kSide, 0.0F);
  for (int cell = finest; cell <= coarsest; cell *= 2) {
    const int n = kSide / cell;
    const auto value = [&](int i, int j) {
      const uint32_t h = hash3(static_cast<uint32_t>(i % n), static_cast<uint32_t>(j % n), seed * 64 + cell);
      return static_cast<float>(h) * 0x1p-31F - 1.0F;
    };
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        float a = static_cast<float>(x % cell) / static_cast<float>(cell);
        float b = static_cast<float>(y % cell) / static_cast<float>(cell);
        a = a * a * (3 - 2 * a);
        b = b * b * (3 - 2 * b);
        const int i = x / cell, j = y / cell;
        const float upper = value(i, j) * (1 - a) + value(i + 1, j) * a;
        const float lower = value(i, j + 1) * (1 - a) + value(i + 1, j + 1) * a;
        values_[static_cast<size_t>(y) * kSide + x] += upper * (1 - b) + lower * b;
      }
    }
  }
  int from = 0;
  for (int level = 1; level < kLevels; ++level) {
    const int side = kSide >> level;
    first_[level] = static_cast<int>(values_.size());
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const auto above = [&](int i, int j) { return values_[from + (2 * y + j) * 2 * side + 2 * x + i]; };
        values_.push_back((above(0, 0) + above(1, 0) + above(0, 1) + above(1, 1)) / 4);
      }
    }
    from = first_[level];
  }
}

}  // namespace sextant::synthetic
