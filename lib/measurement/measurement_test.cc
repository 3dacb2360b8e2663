#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/measurement/image.h"
#include "sextant/measurement/problem.h"

namespace sextant {
namespace {

using ::testing::ElementsAre;

Correspondences three() {
  Correspondences points;
  points.push_back(1, 2, 3, 4, 5, 6);
  points.push_back(10, 20, 30, 40, 50);
  points.push_back(100, 200, 300, 400, 500, 600);
  return points;
}

TEST(Correspondences, PushBackFillsEveryArray) {
  const Correspondences points = three();
  EXPECT_EQ(points.size(), 3U);
  EXPECT_FALSE(points.empty());
  EXPECT_TRUE(Correspondences().empty());
  EXPECT_THAT(points.u, ElementsAre(1, 10, 100));
  EXPECT_THAT(points.v, ElementsAre(2, 20, 200));
  EXPECT_THAT(points.depth, ElementsAre(3, 30, 300));
  EXPECT_THAT(points.flow_u, ElementsAre(4, 40, 400));
  EXPECT_THAT(points.flow_v, ElementsAre(5, 50, 500));
}

TEST(Correspondences, AMissingSecondDepthIsNaN) {
  const Correspondences points = three();
  ASSERT_EQ(points.depth_curr.size(), 3U);
  EXPECT_EQ(points.depth_curr[0], 6);
  EXPECT_TRUE(std::isnan(points.depth_curr[1]));
}

TEST(Correspondences, SubsetKeepsOrderAndAllChannels) {
  const Correspondences kept = three().subset({1, 0, 255});
  EXPECT_THAT(kept.u, ElementsAre(1, 100));
  EXPECT_THAT(kept.v, ElementsAre(2, 200));
  EXPECT_THAT(kept.depth, ElementsAre(3, 300));
  EXPECT_THAT(kept.flow_u, ElementsAre(4, 400));
  EXPECT_THAT(kept.flow_v, ElementsAre(5, 500));
  EXPECT_THAT(kept.depth_curr, ElementsAre(6, 600));
  EXPECT_TRUE(three().subset({0, 0, 0}).empty());
}

TEST(Correspondences, SubsetRefusesAMaskOfAnotherLength) {
  EXPECT_THROW(three().subset({1, 1}), InternalError);
}

TEST(Image, IsRowMajorFromTheTopLeft) {
  Image<int> image(3, 2, 7);
  image(2, 0) = 1;
  image(0, 1) = 2;
  EXPECT_EQ(image.data()[2], 1);
  EXPECT_EQ(image.data()[3], 2);
  EXPECT_EQ(image.row(1)[0], 2);
  EXPECT_EQ(image.size(), 6U);
  EXPECT_EQ(image(1, 1), 7);
}

TEST(Image, ContainsItsPixelsOnly) {
  const Image<int> image(3, 2);
  EXPECT_TRUE(image.contains(0, 0));
  EXPECT_TRUE(image.contains(2, 1));
  EXPECT_FALSE(image.contains(3, 1));
  EXPECT_FALSE(image.contains(2, 2));
  EXPECT_FALSE(image.contains(-1, 0));
  EXPECT_FALSE(Image<int>().contains(0, 0));
  EXPECT_TRUE(Image<int>().empty());
}

TEST(Image, RefusesNegativeSizes) { EXPECT_THROW(Image<int>(-1, 2), InternalError); }

TEST(Flow, IsUnknownUntilSet) {
  EXPECT_FALSE(Flow().valid());
  EXPECT_TRUE((Flow{0, 0}).valid());
  EXPECT_FALSE((Flow{1, INFINITY}).valid());
}

}  // namespace
}  // namespace sextant
