#pragma once

// Noise that costs a few look-ups: a square tile of values that repeats, and smaller and smaller copies of it
// (levels), each the mean of the one before. Octaves of smooth value noise, all of amplitude 1.

#include <cstdint>
#include <vector>

#include "sextant/datasets/synthetic/wide.h"

namespace sextant::synthetic {

class NoiseTile {
 public:
  static constexpr int tile_side = 256;  ///< texels
  static constexpr int levels = 7;
  static constexpr int batch = 256;  ///< samples that are looked up together, at most

  /// Octaves with cells of `finest`, 2 `finest`, ... up to `coarsest` texels, powers of two.
  NoiseTile(int finest, int coarsest, unsigned seed);

  /// Adds `weight` times the mean over round samples of about `width` texels at each of `n` places (x, y), in
  /// texels. `n` <= batch; all arrays have room for wide::whole(n).
  void add_means(const float* x, const float* y, const float* width, const float* weight, int n,
                 float* sum) const;

 private:
  /// Four neighbours in one word, (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) from the lowest byte; a byte
  /// is the value from -range to range.
  std::vector<uint32_t> corners_;
};

}  // namespace sextant::synthetic
