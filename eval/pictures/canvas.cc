#include "sextant/eval/pictures/canvas.h"

#include <opencv2/imgproc.hpp>

#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"

namespace sextant {

cv::Mat bgr_of(const Image<Rgb>& image) {
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3,
                    const_cast<Rgb*>(image.data()));  // OpenCV has no view of const data
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

namespace {

Image<Rgb> rgb_of(const cv::Mat& bgr) {
  Image<Rgb> image(bgr.cols, bgr.rows);
  cv::cvtColor(bgr, cv::Mat(bgr.rows, bgr.cols, CV_8UC3, image.data()), cv::COLOR_BGR2RGB);
  return image;
}

}  // namespace

std::string png_of(const cv::Mat& bgr) { return encode_png(rgb_of(bgr), {.level = 9}); }
std::string jpeg_of(const cv::Mat& bgr, int quality) { return encode_jpeg(rgb_of(bgr), quality); }

}  // namespace sextant
