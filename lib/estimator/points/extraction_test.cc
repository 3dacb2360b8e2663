#include <gtest/gtest.h>
#include <map>
#include <opencv2/features2d.hpp>
#include <random>

#include "sextant/estimator/points/extraction.h"

namespace sextant {
namespace {

/// Blurred noise, which contains corners of all strengths.
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

namespace {

constexpr int width = 200;
constexpr int height = 120;

/// A chequered image with flow (2, 1), depth 10 m and no instances.
Frame make_frame(int index) {
  Frame frame{.index = index, .gray = Image<uint8_t>(width, height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      frame.gray(x, y) = (x / 5 + y / 5) % 2 == 0 ? 200 : 40 + (x * 7 + y * 3) % 20;
  }
  frame.depth_m = Image<float>(width, height, 10.0F);
  frame.flow = Image<Flow>(width, height, Flow{2.0F, 1.0F});
  frame.mask = Image<uint16_t>(width, height, 0);
  return frame;
}

void fill(Image<uint16_t>& mask, int left, int top, int right, int bottom, uint16_t id) {
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) mask(x, y) = id;
  }
}

const StereoCamera camera = {{100, 100, 100, 60}, 50};

TEST(StrongestPerCell, AreSpreadAndStrongestFirst) {
  const Frame frame = make_frame(0);
  const ExtractionOptions options;
  const std::vector<Feature> features =
      strongest_per_cell(fast_corners(frame.gray, options.fast_threshold), width, height, options);
  EXPECT_GT(features.size(), 50U);
  std::map<std::pair<int, int>, std::vector<int>> responses;
  for (const Feature& f : features) responses[{f.x / 20, f.y / 20}].push_back(f.response);
  for (const auto& [cell, list] : responses) {
    EXPECT_LE(list.size(), 2U);
    if (list.size() == 2) {
      EXPECT_GE(list[0], list[1]);
    }
  }
}

TEST(ExtractFramePair, StaticFeaturesAvoidInstancesAndBadMeasurements) {
  Frame prev = make_frame(3);
  Frame curr = make_frame(4);
  fill(prev.mask, 40, 40, 80, 80, 5);
  fill(curr.mask, 120, 40, 150, 80, 6);
  for (int y = 0; y < height; ++y) prev.depth_m(100, y) = NAN;
  for (int y = 0; y < height; ++y) prev.flow(105, y) = Flow{};
  const FramePair pair = extract_frame_pair(prev, curr, camera, 0.1, {});
  EXPECT_EQ(pair.prev, 3);
  EXPECT_EQ(pair.curr, 4);
  ASSERT_GT(pair.background.size(), 20U);
  for (size_t i = 0; i < pair.background.size(); ++i) {
    const int x = static_cast<int>(pair.background.u[i]);
    const int y = static_cast<int>(pair.background.v[i]);
    EXPECT_EQ(prev.mask(x, y), 0);
    EXPECT_EQ(curr.mask(x + 2, y + 1), 0);
    EXPECT_NE(x, 100);
    EXPECT_NE(x, 105);
    EXPECT_EQ(pair.background.depth_curr[i], 10);
  }
}

TEST(ExtractFramePair, DepthLimitOfStaticFeatures) {
  Frame prev = make_frame(0);
  prev.depth_m = Image<float>(width, height, 41.0F);
  EXPECT_TRUE(extract_frame_pair(prev, make_frame(1), camera, 0.1, {}).background.empty());
}

TEST(ExtractFramePair, ObjectPointsAreEveryThirdPixelThatLandsOnAnInstance) {
  Frame prev = make_frame(0);
  Frame curr = make_frame(1);
  fill(prev.mask, 30, 30, 60, 60, 7);
  fill(curr.mask, 32, 31, 62, 61, 7);  // moved with the flow
  const FramePair pair = extract_frame_pair(prev, curr, camera, 0.1, {});
  ASSERT_EQ(pair.objects.size(), 1U);
  const ObjectObservation& object = pair.objects[0];
  EXPECT_EQ(object.instance, 7);
  EXPECT_DOUBLE_EQ(object.area_fraction, 900.0 / (width * height));
  EXPECT_EQ(object.points.size(), 100U);
  EXPECT_EQ(object.n_background, 0);
  for (size_t i = 0; i < object.points.size(); ++i) {
    EXPECT_EQ(static_cast<int>(object.points.u[i]) % 3, 0);
    EXPECT_EQ(static_cast<int>(object.points.v[i]) % 3, 0);
    EXPECT_EQ(object.instance_prev[i], 7);
  }
}

TEST(ExtractFramePair, KnowsWhatAppearsAndWhatIsLost) {
  Frame prev = make_frame(0);
  Frame curr = make_frame(1);
  fill(prev.mask, 30, 30, 60, 60, 7);
  fill(curr.mask, 100, 30, 130, 60, 8);
  const FramePair pair = extract_frame_pair(prev, curr, camera, 0.1, {});
  ASSERT_EQ(pair.objects.size(), 1U);
  EXPECT_EQ(pair.objects[0].instance, 8);
  EXPECT_TRUE(pair.objects[0].points.empty());
  EXPECT_EQ(pair.objects[0].n_background, 100);
  EXPECT_EQ(pair.lost_instances, std::vector<int>{7});
}

TEST(ExtractFramePair, FlowThatLeavesTheImageIsDropped) {
  Frame prev = make_frame(0);
  prev.flow = Image<Flow>(width, height, Flow{500.0F, 0.0F});
  EXPECT_TRUE(extract_frame_pair(prev, make_frame(1), camera, 0.1, {}).background.empty());
}

}  // namespace

}  // namespace sextant
