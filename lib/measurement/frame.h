#pragma once

// What a sensor (and the networks behind it) gives at one instant. Holds no ground truth.
// A channel that was not asked for, or that the source does not have, is an empty image.

#include "sextant/measurement/image.h"

namespace sextant {

struct Frame {
  int index = 0;  ///< the data set's own frame number

  Image<uint8_t> gray;   ///< luminance, 0..255
  Image<Rgb> rgb;        ///< only when asked for (overlays, networks)
  Image<float> depth_m;  ///< z-depth; NaN = invalid
  Image<Flow> flow;      ///< from this frame to the next, px; NaN = invalid
  Image<uint16_t> mask;  ///< instance ids of this frame; 0 = background
};

/// A set of channels to read.
struct Channels {
  bool gray = false;
  bool rgb = false;
  bool depth = false;
  bool flow = false;
  bool mask = false;
};

}  // namespace sextant
