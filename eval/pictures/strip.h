#pragma once

// A picture that shows what a source gives: one row a frame, with columns for the image, depth (near = red),
// flow (hue = direction, strength = length; the wheel is in the corner) and instance masks over the image.

#include <string>

#include "sextant/datasets/dataset.h"

namespace sextant {

/// PNG bytes. Frames are evenly spread; channels that one lacks are dark tiles; `tile_px` is the width of one
/// tile.
std::string draw_strip(const Sequence& sequence, int n_frames, int tile_px);

}  // namespace sextant
