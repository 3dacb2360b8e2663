#pragma once

// Rectangles in images: labels of objects, and what masks show of them. Units: px; x right, y down.

#include <algorithm>
#include <limits>
#include <map>

#include "sextant/measurement/image.h"

namespace sextant {

struct ImageBox {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left,
         bottom = -left;  ///< holds nothing

  double width() const { return right - left; }
  double height() const { return bottom - top; }
  double area() const { return width() * height(); }
  void include(double x, double y) {
    *this = {std::min(left, x), std::min(top, y), std::max(right, x), std::max(bottom, y)};
  }
  bool operator==(const ImageBox&) const = default;
};

/// The area that two boxes share; 0 when they do not meet.
inline double shared_area(const ImageBox& a, const ImageBox& b) {
  const double w = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double h = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return w > 0 && h > 0 ? w * h : 0;
}

/// Intersection over union.
inline double overlap(const ImageBox& a, const ImageBox& b) {
  const double shared = shared_area(a, b);
  return shared / (a.area() + b.area() - shared);
}

/// The pixels of one mask id: the centres of the outermost ones, and how many.
struct MaskOutline {
  ImageBox box;
  int n_pixels = 0;
};

/// By mask id, without the background.
std::map<int, MaskOutline> mask_outlines(const Image<uint16_t>& mask);

}  // namespace sextant
