#pragma once

// Meaning of the pixels in TartanAir V2's depth and flow images (tartanair.org/modalities.html). Invalid pixels
// are NaN on our side.
//
//   depth  8-bit RGBA: the bytes B, G, R, A of a pixel are a little-endian float32, z in m. Values that are not
//          positive, not finite, or from tartanair_sky_m on (the sky sphere) are invalid
//   flow   16-bit RGB: u = (B - 2^15) / 64, v = (G - 2^15) / 64 (px); R is the mask, 0 = valid

#include "sextant/datasets/codec/png.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// The sky of the renderer's scenes lies on a sphere at 10 to 60 km.
inline constexpr float tartanair_sky_m = 5000;

Image<float> depth_from_tartanair(const Image<Rgba>& image);
Image<Flow> flow_from_tartanair(const Image<Rgb16>& image);

/// The inverses. Depth is exact, invalid depth becomes 0. Flow is rounded to 1/64 px; flow that is invalid or
/// cannot be represented gets the mask 1.
Image<Rgba> tartanair_from_depth(const Image<float>& depth_m);
Image<Rgb16> tartanair_from_flow(const Image<Flow>& flow);

}  // namespace sextant
