#include "sextant/estimator/points/fast_corners.h"

#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>
#include <random>

namespace sextant {
namespace {

/// Blurred noise: corners of all strengths.
Image<uint8_t> make_image(int width, int height, unsigned seed, int contrast) {
  std::mt19937 engine(seed);
  Image<uint8_t> coarse(width / 3 + 2, height / 3 + 2);
  for (size_t i = 0; i < coarse.size(); ++i) coarse.data()[i] = static_cast<uint8_t>(engine() % 256);
  Image<uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int value = 128 + (coarse(x / 3, y / 3) - 128) * contrast / 256 + static_cast<int>(engine() % 5);
      image(x, y) = static_cast<uint8_t>(std::clamp(value, 0, 255));
    }
  }
  return image;
}

std::vector<Feature> opencv_corners(const Image<uint8_t>& image, int threshold) {
  const cv::Mat view(image.height(), image.width(), CV_8UC1, const_cast<uint8_t*>(image.data()));
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(view, keypoints, threshold, /*nonmaxSuppression=*/true);
  std::vector<Feature> corners;
  for (const cv::KeyPoint& k : keypoints) {
    corners.push_back({static_cast<int>(k.pt.x), static_cast<int>(k.pt.y), static_cast<int>(k.response)});
  }
  return corners;
}

TEST(FastCorners, SameAsOpenCv) {
  unsigned seed = 0;
  size_t n = 0;
  for (const int width : {7, 8, 38, 39, 64, 101, 200}) {
    for (const int height : {7, 20, 61}) {
      for (const int threshold : {1, 7, 40, 200, 254}) {
        const Image<uint8_t> image = make_image(width, height, seed, seed % 2 == 0 ? 300 : 120);
        const std::vector<Feature> corners = fast_corners(image, threshold);
        EXPECT_EQ(corners, opencv_corners(image, threshold)) << width << ' ' << height << ' ' << threshold;
        n += corners.size();
        ++seed;
      }
    }
  }
  EXPECT_GT(n, 5000U);
}

TEST(FastCorners, SaturatedContrast) {
  Image<uint8_t> image(60, 40, 0);
  for (int y = 10; y < 20; ++y) {
    for (int x = 30; x < 45; ++x) image(x, y) = 255;
  }
  EXPECT_EQ(fast_corners(image, 20), opencv_corners(image, 20));
  EXPECT_TRUE(fast_corners(Image<uint8_t>(6, 6, 3), 7).empty());
  EXPECT_TRUE(fast_corners(Image<uint8_t>(), 7).empty());
}

}  // namespace
}  // namespace sextant
