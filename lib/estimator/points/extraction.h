#pragma once

// From images to points: static features and object samples of one frame pair (docs/method.md, "One frame
// pair").
//
// Features: FAST corners of the previous image off the instances, the best `features_per_cell` of every
// cell, so that they cover the image. Object samples: every n-th pixel in x and y of the previous frame's
// instances whose flow lands on an instance of the current frame.

#include <vector>

#include "sextant/base/options.h"
#include "sextant/estimator/points/fast_corners.h"
#include "sextant/measurement/frame.h"
#include "sextant/measurement/frame_pair.h"

namespace sextant {

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
