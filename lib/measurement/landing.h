#pragma once

// Where the flow at a pixel leads, in whole pixels.

#include <cmath>

#include "sextant/measurement/image.h"

namespace sextant {

/// The pixel nearest to (x, y) + flow, if the flow is known and that pixel lies in a width x height image.
struct Landing {
  int x = 0;
  int y = 0;
  bool inside = false;
};

inline Landing land(int x, int y, const Flow& flow, int width, int height) {
  if (!flow.valid()) return {};
  const float u = static_cast<float>(x) + flow.u;
  const float v = static_cast<float>(y) + flow.v;
  if (!(u > -0.5F && v > -0.5F && u < static_cast<float>(width) - 0.5F &&
        v < static_cast<float>(height) - 0.5F)) {
    return {};
  }
  return {static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v)), true};
}

}  // namespace sextant
