#pragma once

// From images to points: static features and object samples of one frame pair (docs/method.md, "One frame
// pair").
//
// Features: FAST corners of the previous image off the instances, the best `features_per_cell` of every
// cell, so that they cover the image. Object samples: every n-th pixel in x and y of the previous frame's
// instances whose flow lands on an instance of the current frame.

#include <vector>

#include "sextant/base/options.h"
#include "sextant/measurement/frame.h"
#include "sextant/measurement/image.h"
#include "sextant/measurement/problem.h"

namespace sextant {

// FAST-9 corners (Rosten & Drummond, ECCV 2006): 9 contiguous pixels of the 16 on a circle of radius 3 are
// all brighter than the centre by more than the threshold, or all darker. The response is the largest
// threshold at which a pixel is still a corner; a corner must beat its 8 neighbours. Same corners and
// responses as OpenCV's cv::FAST, 32 pixels at a time.

struct Feature {
  int x = 0;
  int y = 0;
  int response = 0;  ///< gray levels
  bool operator==(const Feature&) const = default;
};

/// Row by row, within a row by column. `threshold` in 1..254 gray levels.
std::vector<Feature> fast_corners(const Image<uint8_t>& gray, int threshold);

struct ExtractionOptions {
  SEXTANT_OPTIONS(
      (int, fast_threshold, 7, "gray levels", "FAST-9 contrast of a corner"),
      (int, cell_px, 20, "px", "side of the cells over which features are spread"),
      (int, features_per_cell, 2, "count", "strongest corners kept per cell"),
      (int, mask_margin_px, 2, "px", "static features keep this distance from instances"),
      (double, max_static_depth_m, 40.0, "m", "farthest static feature"),
      (int, object_step_px, 3, "px", "object points are every n-th pixel (paper: 3)"))
  void check() const;
};

/// The strongest corners of every cell; cells row by row, within a cell by falling response, then by row and
/// column. `width`, `height` of the image, px.
std::vector<Feature> strongest_per_cell(const std::vector<Feature>& corners, int width, int height,
                                        const ExtractionOptions& options);

/// The pair's measurements. `prev` needs gray, depth, flow, mask;
/// `curr` needs mask, and depth if there is one.
FramePair extract_frame_pair(const Frame& prev, const Frame& curr, const StereoCamera& camera, double dt_s,
                             const ExtractionOptions& options);

}  // namespace sextant
