#pragma once

// A picture that shows what a source gives: one row a frame, with columns for the image, depth (near = red),
// flow (hue = direction, strength = length; the wheel is in the corner) and instance masks over the image.

#include <span>
#include <string>

#include "sextant/eval/experiment/run.h"

namespace sextant {

/// PNG bytes. Channels that a frame lacks are dark tiles; `tile_px` is the width of one tile.
std::string draw_strip(std::span<const Frame> frames, int tile_px = 414);

}  // namespace sextant
