#pragma once

// Noise from a few look-ups: a square, periodic tile of values, and successively smaller copies of it
// (levels), each the mean of the one before. Octaves of smooth value noise, all of amplitude 1.

#include <cstdint>
#include <vector>

#include "sextant/datasets/synthetic/mesh.h"
#include "sextant/datasets/synthetic/wide.h"

namespace sextant::synthetic {

class NoiseTile {
 public:
  static constexpr int tile_side = 256;  ///< texels
  static constexpr int levels = 7;
  static constexpr int batch = 256;  ///< largest number of samples per look-up

  /// Creates octaves with cells of `finest`, 2 `finest`, ... up to `coarsest` texels, powers of two.
  NoiseTile(int finest, int coarsest, unsigned seed);

  /// Adds `weight` times the mean over round samples of about `width` texels at each of `n` positions (x, y),
  /// in texels. `n` <= batch; all arrays have at least wide::whole(n) elements.
  void add_means(const float* x, const float* y, const float* width, const float* weight, int n,
                 float* sum) const;

 private:
  /// Four neighbours in one word, (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) from the lowest byte; a byte
  /// encodes the value from -range to range.
  std::vector<uint32_t> corners_;
};

// Procedural textures, filtered analytically: details finer than the sample are averaged, so images have no
// aliasing at any distance. The texture is a function of the position on the surface only: a point looks the
// same in every frame (up to the filter, the light and shadows).

/// One quantity of all samples of a batch: at[i] belongs to sample i. The samples of a batch are shaded
/// together.
struct Lane {
  alignas(32) float at[NoiseTile::batch] = {};
  float& operator[](int i) { return at[i]; }
  float operator[](int i) const { return at[i]; }
};

/// The pieces of a surface under pixels: the position (u, v), m, and its change (m) to the next pixel on the
/// right (x) and below (y); the lengths (m) over which it is averaged.
struct Footprints {
  Lane u, v, u_x, v_x, u_y, v_y;
  // Computed from the above by measure():
  Lane width_u, width_v;  ///< along u and along v, for patterns
  Lane width;             ///< width of `count` round samples along the longer side, for noise
  Lane along_u, along_v;  ///< the longer side
  Lane count;             ///< 1, 2 or 3
  void measure(int n);
};

/// Colours (0..1).
struct Colours {
  Lane red, green, blue;
};

/// Computes the colours of the surface, unlit, at `n` positions, at most NoiseTile::batch.
void surface_colours(const Look& look, const Footprints& footprints, int n, Colours& colours);

/// Computes the colours of the sky in the world directions (u, v, u_x), of any length; overwrites
/// `directions`.
void sky_colours(Footprints& directions, int n, Colours& colours);

}  // namespace sextant::synthetic
