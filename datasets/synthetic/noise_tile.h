#pragma once

// Noise that costs a few look-ups: a square tile of values that repeats, and smaller and smaller copies of it
// (levels), each the mean of the one before. Octaves of smooth value noise, all of amplitude 1.

#include <cmath>
#include <vector>

namespace sextant::synthetic {

class NoiseTile {
 public:
  static constexpr int kSide = 256;  ///< texels
  static constexpr int kLevels = 7;

  /// Octaves with cells of `finest`, 2 `finest`, ... up to `coarsest` texels, powers of two.
  NoiseTile(int finest, int coarsest, unsigned seed);

  /// Mean over about `width` texels around (x, y), both in texels.
  float operator()(float x, float y, float width) const {
    const float level = width > 1 ? fast_log2(width) : 0.0F;
    const int low = static_cast<int>(level);
    if (low >= kLevels - 1) return 0;
    const float part = level - static_cast<float>(low);
    const float scale = 1.0F / static_cast<float>(1 << low);
    const float offset = 0.5F * scale - 0.5F;  // texel centres of a level lie between those of the one below
    const float fine = at(low, x * scale + offset, y * scale + offset);
    if (part < 0.02F) return fine;
    const float coarse =
        at(low + 1, x * scale * 0.5F + 0.25F * scale - 0.5F, y * scale * 0.5F + 0.25F * scale - 0.5F);
    return fine + part * (coarse - fine);
  }

 private:
  /// Piecewise linear between powers of two; enough to choose a level smoothly.
  static float fast_log2(float x) {
    int exponent = 0;
    float mantissa = x;
    while (mantissa >= 2 && exponent < kLevels) {
      mantissa *= 0.5F;
      ++exponent;
    }
    return static_cast<float>(exponent) + mantissa - 1;
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
