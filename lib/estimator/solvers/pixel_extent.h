#pragma once

// The smallest upright rectangle around points, px. Points: anything with numbers u and v.

#include <algorithm>
#include <limits>

namespace sextant {

struct PixelExtent {
  double min_u = std::numeric_limits<double>::infinity(), min_v = min_u;
  double max_u = -min_u, max_v = -min_u;

  template <typename Points>
  explicit PixelExtent(const Points& points) {
    for (const auto& p : points) {
      min_u = std::min(min_u, p.u), max_u = std::max(max_u, p.u);
      min_v = std::min(min_v, p.v), max_v = std::max(max_v, p.v);
    }
  }
  double width() const { return max_u - min_u; }
  double height() const { return max_v - min_v; }
  /// False for no points, and where they are so far apart that nothing is near anything.
  bool is_of_an_image() const {
    constexpr double widest_image = 1e6;
    return min_u <= max_u && std::max(width(), height()) < widest_image;
  }
};

}  // namespace sextant
