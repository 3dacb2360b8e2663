#pragma once

// Procedural textures, filtered analytically: what is finer than the sample is averaged away, so images have
// no aliasing at any distance. A function of the place on the surface only: the same point looks the same in
// every frame (up to the filter, the light and shadows).

#include "sextant/datasets/synthetic/mesh.h"
#include "sextant/datasets/synthetic/noise_tile.h"

namespace sextant::synthetic {

/// Values of samples that are shaded together.
struct Lane {
  alignas(32) float at[NoiseTile::batch] = {};
  float& operator[](int i) { return at[i]; }
  float operator[](int i) const { return at[i]; }
};

/// The pieces of a surface under pixels: the place (u, v), m, and how it changes (m) from a pixel to the next
/// one to the right (x) and below (y); the lengths (m) over which it is averaged.
struct Footprints {
  Lane u, v, u_x, v_x, u_y, v_y;
  // Of these, by measure():
  Lane width_u, width_v;  ///< along u and along v, for patterns
  Lane width;             ///< of `count` round samples along the longer side, for noise
  Lane along_u, along_v;  ///< the longer side
  Lane count;             ///< 1, 2 or 3
  void measure(int n);
};

/// Colours (0..1).
struct Colours {
  Lane red, green, blue;
};

/// The surface, unlit, at `n` places, at most NoiseTile::batch.
void surface_colours(const Look& look, const Footprints& footprints, int n, Colours& colours);

/// The sky in the world directions (u, v, u_x), of any length.
void sky_colours(Footprints& directions, int n, Colours& colours);

}  // namespace sextant::synthetic
