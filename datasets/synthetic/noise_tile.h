#pragma once

// Noise that costs a few look-ups: a square tile of values that repeats, and smaller and smaller copies of it
// (levels), each the mean of the one before. Octaves of smooth value noise, all of amplitude 1.

#include <bit>
#include <cstdint>
#include <vector>

namespace sextant::synthetic {

class NoiseTile {
 public:
  static constexpr int kSide = 256;  ///< texels
  static constexpr int kLevels = 7;

  /// Octaves with cells of `finest`, 2 `finest`, ... up to `coarsest` texels, powers of two.
  NoiseTile(int finest, int coarsest, unsigned seed);

  /// Mean over `n` round samples of about `width` texels, evenly spread over the line of length (dx, dy)
  /// around (x, y); all in texels.
  float mean(float x, float y, float width, int n, float dx, float dy) const {
    const float level = width > 1 ? log2_piecewise(width) : 0.0F;
    const int low = static_cast<int>(level);
    if (low >= kLevels - 1) return 0;
    const float part = level - static_cast<float>(low);
    const float fine = mean_at(low, x, y, n, dx, dy);
    if (part < 0.02F) return fine;
    return fine + part * (mean_at(low + 1, x, y, n, dx, dy) - fine);
  }

 private:
  /// Linear between powers of two: enough to choose a level smoothly.
  static float log2_piecewise(float x) {
    const auto bits = std::bit_cast<uint32_t>(x);
    return static_cast<float>(bits) * 0x1p-23F - 127.0F;
  }
  float mean_at(int level, float x, float y, int n, float dx, float dy) const {
    const float scale = 1.0F / static_cast<float>(1 << level);
    const float offset = 0.5F * scale - 0.5F;  // texel centres of a level lie between those of the one below
    if (n == 1) return at(level, x * scale + offset, y * scale + offset);
    const float step = 1.0F / static_cast<float>(n);
    float sum = 0;
    for (int i = 0; i < n; ++i) {
      const float along = (static_cast<float>(i) + 0.5F) * step - 0.5F;
      sum += at(level, (x + along * dx) * scale + offset, (y + along * dy) * scale + offset);
    }
    return sum * step;
  }
  float at(int level, float x, float y) const {
    const int side = kSide >> level;
    const int ix = floor_int(x), iy = floor_int(y);
    const float a = x - static_cast<float>(ix), b = y - static_cast<float>(iy);
    const float* values = values_.data() + first_[level];
    const float* top = values + (iy & (side - 1)) * side;
    const float* bottom = values + ((iy + 1) & (side - 1)) * side;
    const int x0 = ix & (side - 1), x1 = (ix + 1) & (side - 1);
    const float upper = top[x0] + a * (top[x1] - top[x0]);
    const float lower = bottom[x0] + a * (bottom[x1] - bottom[x0]);
    return upper + b * (lower - upper);
  }
  /// std::floor for numbers that fit; without SSE4.1 the library's is a call.
  static int floor_int(float x) {
    const int towards_zero = static_cast<int>(x);
    return towards_zero - static_cast<int>(x < static_cast<float>(towards_zero));
  }

  int first_[kLevels] = {};
  std::vector<float> values_;
};

}  // namespace sextant::synthetic
