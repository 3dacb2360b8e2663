#pragma once

// A dense row-major raster. Pixel (x, y) = column x, row y; (0, 0) is the centre of the top-left pixel.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {

template <typename T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T fill = T{}) : width_(width), height_(height) {
    SEXTANT_CHECK(width >= 0 && height >= 0);
    pixels_.assign(static_cast<size_t>(width) * static_cast<size_t>(height), fill);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  T& operator()(int x, int y) { return pixels_[index(x, y)]; }
  const T& operator()(int x, int y) const { return pixels_[index(x, y)]; }
  T* row(int y) { return pixels_.data() + index(0, y); }
  const T* row(int y) const { return pixels_.data() + index(0, y); }
  T* data() { return pixels_.data(); }
  const T* data() const { return pixels_.data(); }
  size_t size() const { return pixels_.size(); }

  bool operator==(const Image&) const = default;

 private:
  size_t index(int x, int y) const { return static_cast<size_t>(y) * static_cast<size_t>(width_) + x; }

  int width_ = 0;
  int height_ = 0;
  std::vector<T> pixels_;
};

/// Column x and row y of a pixel.
struct Pixel {
  int x = 0, y = 0;
};

/// The pixels of a raster, row by row:  for (const auto [x, y] : pixels(image)) sum += image(x, y);
class PixelRange {
 public:
  struct End {};
  struct Iterator {
    Pixel at;
    int width, height;
    Pixel operator*() const { return at; }
    Iterator& operator++() {
      if (++at.x == width) at = {0, at.y + 1};
      return *this;
    }
    bool operator==(End) const { return at.y >= height; }
  };

  PixelRange(int width, int height) : width_(width), height_(width > 0 ? height : 0) {}
  Iterator begin() const { return {{}, width_, height_}; }
  End end() const { return {}; }

 private:
  int width_, height_;
};

template <typename T>
PixelRange pixels(const Image<T>& image) {
  return {image.width(), image.height()};
}

/// Returns the width x height image whose pixel (x, y) is value(x, y).
template <typename Value>
auto image_of(int width, int height, const Value& value) {
  Image<decltype(value(0, 0))> image(width, height);
  for (const auto [x, y] : pixels(image)) image(x, y) = value(x, y);
  return image;
}

struct Rgb {
  uint8_t r = 0;
  uint8_t g = 0;
  uint8_t b = 0;
  bool operator==(const Rgb&) const = default;
};

inline bool valid_depth(double depth_m) { return std::isfinite(depth_m) && depth_m > 0; }

/// Optical flow at one pixel (px); NaN = unknown.
struct Flow {
  float u = NAN;
  float v = NAN;
  bool valid() const { return std::isfinite(u) && std::isfinite(v); }
};

// Axis-aligned boxes in images: labels of objects and outlines of masks. Units: px; x right, y down.

struct ImageBox {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left,
         bottom = -left;  ///< an empty box

  double width() const { return right - left; }
  double height() const { return bottom - top; }
  double area() const { return width() * height(); }
  void include(double x, double y) {
    *this = {std::min(left, x), std::min(top, y), std::max(right, x), std::max(bottom, y)};
  }
  bool operator==(const ImageBox&) const = default;
};

/// Returns the area of the intersection of two boxes (px^2); 0 if they are disjoint.
inline double shared_area(const ImageBox& a, const ImageBox& b) {
  const double w = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double h = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return w > 0 && h > 0 ? w * h : 0;
}

/// Returns the intersection over union of two boxes.
inline double overlap(const ImageBox& a, const ImageBox& b) {
  const double shared = shared_area(a, b);
  return shared / (a.area() + b.area() - shared);
}

/// Extent of one mask id: the bounding box of its pixel centres, and the number of its pixels.
struct MaskOutline {
  ImageBox box;
  int n_pixels = 0;
};

/// Returns the outline of each mask id except the background.
inline std::map<int, MaskOutline> mask_outlines(const Image<uint16_t>& mask) {
  std::map<int, MaskOutline> outlines;
  for (int y = 0; y < mask.height(); ++y) {
    const uint16_t* row = mask.row(y);
    for (int first = 0, end = 0; first < mask.width(); first = end) {
      while (end < mask.width() && row[end] == row[first]) ++end;
      if (row[first] == 0) continue;
      MaskOutline& outline = outlines[row[first]];
      outline.box.include(first, y);
      outline.box.include(end - 1, y);
      outline.n_pixels += end - first;
    }
  }
  return outlines;
}

}  // namespace sextant
