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

/// JPEG bytes: one body of a pair on its previous frame, cut out around its points; the whole frame for the camera.
/// Points that the estimate agrees with as discs, the others as crosses, all with a quarter of their flow, and the
/// outline where the frame has masks. `frame` has rgb.
std::string draw_body(const Frame& frame, const BodyResult& body, int width_px);

}  // namespace sextant
