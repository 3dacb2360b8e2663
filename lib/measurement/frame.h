#pragma once

// Output of a sensor, and of the networks that process it, at one instant; it contains no ground truth. A
// channel that was not requested, or that the source does not have, is an empty image.

#include "sextant/measurement/image.h"

namespace sextant {

struct Frame {
  int index = 0;  ///< the data set's own frame number

  Image<uint8_t> gray;        ///< luminance, 0..255
  Image<Rgb> rgb;             ///< only if requested (overlays, networks)
  Image<Rgb> rgb_right;       ///< the right camera's image, rectified with the left
  Image<float> depth_m;       ///< z-depth; NaN = invalid
  Image<Flow> flow;           ///< from this frame to the next, px; NaN = invalid
  Image<Flow> backward_flow;  ///< from this frame to the one before, px; NaN = invalid
  Image<uint16_t> mask;       ///< instance ids of this frame; 0 = background
};

/// A set of channels to read.
struct Channels {
  bool gray = false;
  bool rgb = false;
  bool rgb_right = false;
  bool depth = false;
  bool flow = false;
  bool backward_flow = false;
  bool mask = false;

  static constexpr Channels all();
};

constexpr Channels Channels::all() {
  return {.gray = true,
          .rgb = true,
          .rgb_right = true,
          .depth = true,
          .flow = true,
          .backward_flow = true,
          .mask = true};
}

/// Target of the optical flow at a pixel: the pixel of the next image nearest to (x, y) + flow. If the flow
/// is not known or the target lies outside the width x height image, `inside` is false and the pixel is
/// (0, 0).
struct TargetPixel {
  int x = 0;
  int y = 0;
  bool inside = false;
};

inline TargetPixel target_pixel(int x, int y, const Flow& flow, int width, int height) {
  const float u = static_cast<float>(x) + flow.u;
  const float v = static_cast<float>(y) + flow.v;
  if (!(u > -0.5F && v > -0.5F && u < static_cast<float>(width) - 0.5F &&
        v < static_cast<float>(height) - 0.5F)) {
    return {};  // also if the flow is NaN
  }
  const auto nearest = [](float value) { return static_cast<int>(static_cast<double>(value) + 0.5); };
  return {nearest(u), nearest(v), true};
}

}  // namespace sextant
