#pragma once

// Images of this project as OpenCV matrices, and the number of OpenCV's threads.

#include <opencv2/core.hpp>

#include "sextant/measurement/image.h"

namespace sextant::internal {

/// Returns a view of the memory of `image`. The image must outlive the view, and must not be changed through
/// it.
inline cv::Mat view(const Image<uint8_t>& image) {
  return {image.height(), image.width(), CV_8UC1, const_cast<uint8_t*>(image.data())};
}
inline cv::Mat view(const Image<Rgb>& image) {
  return {image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data())};
}

/// Limits OpenCV to one thread, because it divides an image into as many stripes as it has threads, and the
/// flow of DIS differs at the borders of the stripes. Frames run in parallel instead.
inline void one_opencv_thread() {
  if (cv::getNumThreads() != 1) cv::setNumThreads(1);
}

}  // namespace sextant::internal
