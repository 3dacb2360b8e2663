#pragma once

// Where the flow at a pixel leads, in whole pixels.

#include "sextant/measurement/image.h"

namespace sextant {

/// The pixel nearest to (x, y) + flow, if the flow is known and that pixel lies in a width x height image.
struct Landing {
  int x = 0;
  int y = 0;
  bool inside = false;
};

inline Landing land(int x, int y, const Flow& flow, int width, int height) {
  const float u = static_cast<float>(x) + flow.u;
  const float v = static_cast<float>(y) + flow.v;
  if (!(u > -0.5F && v > -0.5F && u < static_cast<float>(width) - 0.5F &&
        v < static_cast<float>(height) - 0.5F)) {
    return {};  // or NaN
  }
  const auto nearest = [](float value) { return static_cast<int>(static_cast<double>(value) + 0.5); };
  return {nearest(u), nearest(v), true};
}

}  // namespace sextant
