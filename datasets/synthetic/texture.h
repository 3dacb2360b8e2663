#pragma once

// Procedural textures, filtered analytically: what is finer than the sample is averaged away, so images have
// no aliasing at any distance. A function of the place on the surface only: the same point looks the same in
// every frame (up to the filter, the light and shadows).

#include "sextant/datasets/synthetic/mesh.h"
#include "sextant/datasets/synthetic/noise_tile.h"

namespace sextant::synthetic {

/// The piece of a surface under one pixel: the place (u, v), m, and how it changes (m) from a pixel to the
/// next one to the right (x) and below (y).
struct Footprint {
  float u = 0;
  float v = 0;
  float u_x = 0, v_x = 0;
  float u_y = 0, v_y = 0;
};

/// Colour (0..1) of the surface, unlit.
Eigen::Vector3f surface_colour(const Look& look, const Footprint& footprint);

/// Colour (0..1) of the sky in a world direction.
Eigen::Vector3f sky_colour(const Eigen::Vector3d& direction);

}  // namespace sextant::synthetic
