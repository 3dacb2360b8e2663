#pragma once

// Procedural textures, filtered analytically: what is finer than the sample is averaged away, so images have
// no aliasing at any distance. A function of the place on the surface only: the same point looks the same in
// every frame (up to the filter, the light and shadows).

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

/// The piece of a surface under one pixel: an ellipse around (u, v), m. `major` is half of the long axis,
/// `minor_m` half of the short one.
struct Footprint {
  double u = 0;
  double v = 0;
  Eigen::Vector2d major_m = Eigen::Vector2d::Zero();
  double minor_m = 0;
};

/// Colour (0..1) of the surface, unlit.
Eigen::Vector3f surface_colour(const Look& look, const Footprint& footprint);

/// Colour (0..1) of the sky in a world direction.
Eigen::Vector3f sky_colour(const Eigen::Vector3d& direction);

}  // namespace sextant::synthetic
