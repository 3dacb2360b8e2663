#include "sextant/datasets/codec/jpeg.h"

#include <opencv2/imgcodecs.hpp>

#include <cstdint>
#include <limits>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {
namespace {

constexpr std::string_view start = "\xff\xd8";
constexpr std::string_view end_marker = "\xff\xd9";

// OpenCV's decoder fills what is missing with gray and only prints a warning.
void check_complete(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(start)) fail("{}: not a JPEG file (it does not start with FF D8)", name);
  const size_t last = bytes.find_last_not_of('\0');  // padding at the end does no harm
  if (last == std::string_view::npos || !bytes.substr(0, last + 1).ends_with(end_marker)) {
    fail("{}: JPEG file is truncated (no end marker FF D9): copy it again", name);
  }
}

}  // namespace

Image<Rgb> decode_jpeg_rgb(std::string_view bytes, const std::string& name) {
  check_complete(bytes, name);
  if (bytes.size() > static_cast<size_t>(std::numeric_limits<int>::max()))
    fail("{}: file is too large", name);
  const cv::Mat view(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
  cv::Mat bgr;
  try {
    bgr = cv::imdecode(view, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    bgr.release();
  }
  if (bgr.empty()) fail("{}: damaged JPEG file: copy it again", name);
  Image<Rgb> image(bgr.cols, bgr.rows);
  for (int y = 0; y < bgr.rows; ++y) {
    const auto* from = bgr.ptr<uint8_t>(y);
    for (int x = 0; x < bgr.cols; ++x) image(x, y) = {from[3 * x + 2], from[3 * x + 1], from[3 * x]};
  }
  return image;
}

std::string encode_jpeg(const Image<Rgb>& image, int quality) {
  SEXTANT_CHECK(!image.empty() && quality >= 1 && quality <= 100);
  cv::Mat bgr(image.height(), image.width(), CV_8UC3);
  for (int y = 0; y < image.height(); ++y) {
    auto* to = bgr.ptr<uint8_t>(y);
    for (int x = 0; x < image.width(); ++x) {
      to[3 * x] = image(x, y).b;
      to[3 * x + 1] = image(x, y).g;
      to[3 * x + 2] = image(x, y).r;
    }
  }
  std::vector<uint8_t> bytes;
  SEXTANT_CHECK(cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, quality}));
  return {bytes.begin(), bytes.end()};
}

}  // namespace sextant
