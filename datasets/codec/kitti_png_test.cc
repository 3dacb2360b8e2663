#include "sextant/datasets/codec/kitti_png.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

TEST(KittiPng, DisparityGivesDepthAndBack) {
  Image<uint16_t> n(3, 1);
  n(0, 0) = 0;
  n(1, 0) = 256;
  n(2, 0) = 12345;
  const Image<float> depth = depth_from_disparity256(n, 387.5744);
  EXPECT_TRUE(std::isnan(depth(0, 0)));
  EXPECT_FLOAT_EQ(depth(1, 0), 387.5744f);
  EXPECT_FLOAT_EQ(depth(2, 0), static_cast<float>(387.5744 / (12345 / 256.0)));
  EXPECT_EQ(disparity256_from_depth(depth, 387.5744), n);
}

TEST(KittiPng, DepthBenchmarkHasSteps256) {
  Image<uint16_t> n(2, 1);
  n(1, 0) = 3200;
  EXPECT_TRUE(std::isnan(depth_from_depth256(n)(0, 0)));
  EXPECT_EQ(depth_from_depth256(n)(1, 0), 12.5f);
}

TEST(KittiPng, CentimetresGiveDepthAndBack) {
  Image<uint16_t> n(3, 1);
  n(0, 0) = 65535;
  n(1, 0) = 0;
  n(2, 0) = 1234;
  const Image<float> depth = depth_from_cm(n);
  EXPECT_TRUE(std::isnan(depth(0, 0)));
  EXPECT_EQ(depth(1, 0), 0.0f);
  EXPECT_FLOAT_EQ(depth(2, 0), 12.34f);
  EXPECT_EQ(cm_from_depth(depth), n);
}

TEST(KittiPng, WhatCannotBeWrittenIsInvalid) {
  Image<float> depth(3, 1);
  depth(0, 0) = NAN;
  depth(1, 0) = 1e-4f;
  depth(2, 0) = 1e6f;
  const Image<uint16_t> disparity = disparity256_from_depth(depth, 400.0);
  EXPECT_EQ(disparity, Image<uint16_t>(3, 1, 0));
  EXPECT_EQ(cm_from_depth(depth)(0, 0), 65535);
  EXPECT_EQ(cm_from_depth(depth)(2, 0), 65535);
}

TEST(KittiPng, FlowOfBothDialectsGoesThroughWithinHalfAStep) {
  Image<Flow> flow(1242, 2);
  flow(0, 0) = {12.34f, -0.77f};
  flow(5, 1) = {-300.0f, 0.4f};
  const Image<Flow> kitti = flow_from_kitti(kitti_from_flow(flow));
  const Image<Flow> vkitti = flow_from_vkitti(vkitti_from_flow(flow));
  for (const auto& [x, y] : {std::pair{0, 0}, {5, 1}}) {
    EXPECT_NEAR(kitti(x, y).u, flow(x, y).u, 0.5 / 64 + 1e-4);
    EXPECT_NEAR(kitti(x, y).v, flow(x, y).v, 0.5 / 64 + 1e-4);
    EXPECT_NEAR(vkitti(x, y).u, flow(x, y).u, 1241.0 / 65535 + 1e-4);
    EXPECT_NEAR(vkitti(x, y).v, flow(x, y).v, 1.0 / 65535 + 1e-4);
  }
  EXPECT_FALSE(kitti(1, 1).valid());
  EXPECT_FALSE(vkitti(1, 1).valid());
}

}  // namespace
}  // namespace sextant
