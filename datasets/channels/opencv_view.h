#pragma once

// Our images as OpenCV's, and one rule for its threads.

#include <opencv2/core.hpp>

#include "sextant/measurement/image.h"

namespace sextant::internal {

/// The same memory as `image`, which must outlive the view and is not to be written to.
inline cv::Mat view(const Image<uint8_t>& image) {
  return {image.height(), image.width(), CV_8UC1, const_cast<uint8_t*>(image.data())};
}
inline cv::Mat view(const Image<Rgb>& image) {
  return {image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data())};
}

/// OpenCV cuts an image into as many stripes as it has threads, and DIS gives other flow at their borders: it
/// gets one thread. Frames run in parallel instead.
inline void one_opencv_thread() {
  if (cv::getNumThreads() != 1) cv::setNumThreads(1);
}

}  // namespace sextant::internal
