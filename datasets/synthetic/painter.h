#pragma once

// Colour image of a view. Textures are filtered analytically; pixels on edges of surfaces and of shadows are
// the mean of three samples.

#include "sextant/datasets/synthetic/shading.h"

namespace sextant::synthetic {

Image<Rgb> paint(const Bodies& bodies, const ShadowCasters& casters, const View& view,
                 const PinholeCamera& camera);

}  // namespace sextant::synthetic
