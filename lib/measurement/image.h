#pragma once

// A dense row-major raster. Pixel (x, y) = column x, row y; (0, 0) is the centre of the top-left pixel.

#include <cmath>
#include <cstdint>
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

/// Column and row.
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

/// The image whose pixel (x, y) is value(x, y).
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

/// Optical flow of one pixel (px); NaN = unknown.
struct Flow {
  float u = NAN;
  float v = NAN;
  bool valid() const { return std::isfinite(u) && std::isfinite(v); }
};

}  // namespace sextant
