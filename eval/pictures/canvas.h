#pragma once

// Images of ours as OpenCV's, whose channels are blue, green, red; and back, as the bytes of a PNG or JPEG file.

#include <opencv2/core/mat.hpp>
#include <string>

#include "sextant/measurement/image.h"

namespace sextant {

cv::Mat bgr_of(const Image<Rgb>& image);
std::string png_of(const cv::Mat& bgr);
std::string jpeg_of(const cv::Mat& bgr, int quality);

}  // namespace sextant
