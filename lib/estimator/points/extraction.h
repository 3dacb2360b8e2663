#pragma once

// Point extraction: static features and object samples of one frame pair (docs/method.md).
//
// Features: FAST corners of the previous image that have a depth, lie outside the instances, and whose flow
// ends in the image outside the instances; the strongest `features_per_cell` of each cell are kept, so that
// features cover the image. Object samples: every n-th pixel in x and y that has a depth, lies on an instance
// of the previous frame, and whose flow ends on an instance of the current frame.

#include <vector>

#include "sextant/base/options.h"
#include "sextant/measurement/frame.h"
#include "sextant/measurement/image.h"
#include "sextant/measurement/problem.h"

namespace sextant {

// FAST-9 corners (Rosten & Drummond, ECCV 2006): 9 contiguous pixels of the 16 on a circle of radius 3 are
// all brighter than the centre by more than the threshold, or all darker. The response is the largest
// threshold at which the pixel is still a corner; a corner must exceed its 8 neighbours. Corners and
// responses are equal to those of OpenCV's cv::FAST; 32 pixels are processed at a time.

struct Feature {
  int x = 0;
  int y = 0;
  int response = 0;  ///< gray levels
  bool operator==(const Feature&) const = default;
};

/// Returns the corners row by row, from left to right. `threshold` in 1..254 gray levels.
std::vector<Feature> fast_corners(const Image<uint8_t>& gray, int threshold);

struct ExtractionOptions {
  SEXTANT_OPTIONS((int, fast_threshold, 7, "gray levels", "FAST-9 contrast of a corner"),
                  (int, cell_px, 20, "px", "side of the cells over which features are spread"),
                  (int, features_per_cell, 2, "count", "strongest corners kept per cell"),
                  (int, mask_margin_px, 2, "px",
                   "static features keep this distance from the instances of the previous mask"),
                  (double, max_static_depth_m, 40.0, "m", "largest depth of a static feature"),
                  (int, object_step_px, 3, "px", "object points are every n-th pixel (paper: 3)"))
  void check() const;
};

/// Returns the strongest corners of every cell: cells row by row; within a cell by descending response, then
/// by row and column. `width`, `height`: size of the image, px.
std::vector<Feature> strongest_per_cell(const std::vector<Feature>& corners, int width, int height,
                                        const ExtractionOptions& options);

/// Extracts the measurements of a frame pair. `prev` must have gray, depth, flow and mask; `curr` must have a
/// mask and may have depth.
FramePair extract_frame_pair(const Frame& prev, const Frame& curr, const StereoCamera& camera, double dt_s,
                             const ExtractionOptions& options);

}  // namespace sextant
