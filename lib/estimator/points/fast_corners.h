#pragma once

// FAST-9 corners (Rosten & Drummond, ECCV 2006): 9 contiguous pixels of the 16 on a circle of radius 3 are
// all brighter than the centre by more than the threshold, or all darker. The response is the largest
// threshold at which a pixel is still a corner; a corner must beat its 8 neighbours. Same corners and
// responses as OpenCV's cv::FAST, 32 pixels at a time.

#include <vector>

#include "sextant/measurement/image.h"

namespace sextant {

struct Feature {
  int x = 0;
  int y = 0;
  int response = 0;  ///< gray levels
  bool operator==(const Feature&) const = default;
};

/// Row by row, within a row by column. `threshold` in 1..254 gray levels.
std::vector<Feature> fast_corners(const Image<uint8_t>& gray, int threshold);

}  // namespace sextant
