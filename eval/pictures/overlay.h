#pragma once

// A picture of one frame pair: the previous image with the static features and flow that gave the ego motion,
// and every moving object with its points, contour and speed. Colours are Okabe and Ito's, told apart by
// colour-blind readers too.

#include <string>
#include <vector>

#include "sextant/eval/experiment/run.h"

namespace sextant {

/// PNG bytes. `frame` is the previous frame of the pair with rgb and mask; `records` are those of the pair.
/// The picture is twice as wide as the frame; `width_px` > 0 shrinks it to that width.
std::string draw_overlay(const Frame& frame, const FrameResult& result, const std::vector<Record>& records,
                         int width_px = 0);

}  // namespace sextant
