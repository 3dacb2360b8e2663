#include "sextant/estimator/classification.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sextant {
namespace {

// Points of a body that moves by `motion` in camera coordinates while the camera stands still.
Problem moving_points(const Eigen::Vector3d& motion, int n) {
  Problem problem;
  problem.camera = {{700, 700, 600, 180}, 380};
  for (int i = 0; i < n; ++i) {
    const double u = 500 + 7 * i;
    const double v = 150 + 3 * i;
    const Eigen::Vector3d m = problem.camera.left.backproject(u, v, 10);
    const Eigen::Vector2d uv = problem.camera.left.project(m + motion);
    problem.points.push_back(u, v, 10, uv.x() - u, uv.y() - v, 10 + motion.z());
  }
  return problem;
}

TEST(ClassifyMotion, SeparatesMovingFromStanding) {
  const MotionClass moving = classify_motion(moving_points({0, 0, 0.5}, 20), SE3(), 0.1, {});
  EXPECT_TRUE(moving.is_dynamic);
  EXPECT_DOUBLE_EQ(moving.moving_share, 1.0);
  EXPECT_EQ(moving.n_points, 20);
  const MotionClass standing = classify_motion(moving_points({0.05, 0, 0.05}, 20), SE3(), 0.1, {});
  EXPECT_FALSE(standing.is_dynamic);
  EXPECT_DOUBLE_EQ(standing.moving_share, 0.0);
}

TEST(ClassifyMotion, ThresholdIsASpeed) {
  const Problem object = moving_points({0, 0, 0.2}, 10);
  EXPECT_TRUE(classify_motion(object, SE3(), 0.1, {}).is_dynamic);   // 2 m/s
  EXPECT_FALSE(classify_motion(object, SE3(), 0.2, {}).is_dynamic);  // 1 m/s
}

TEST(ClassifyMotion, CameraMotionIsTakenOut) {
  // Static points seen by a camera that moves 1 m forward.
  const SE3 T_curr_prev(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -1));
  const Problem object = moving_points({0, 0, -1}, 10);
  EXPECT_FALSE(classify_motion(object, T_curr_prev, 0.1, {}).is_dynamic);
  EXPECT_TRUE(classify_motion(object, SE3(), 0.1, {}).is_dynamic);
}

TEST(ClassifyMotion, VerticalFlowCountsOnlyOnRequest) {
  const Problem object = moving_points({0, 0.5, 0}, 10);
  EXPECT_FALSE(classify_motion(object, SE3(), 0.1, {}).is_dynamic);
  EXPECT_TRUE(classify_motion(object, SE3(), 0.1, {.use_vertical = true}).is_dynamic);
}

TEST(ClassifyMotion, UnknownWithoutCurrentDepth) {
  Problem object = moving_points({0, 0, 0}, 10);
  object.points.depth_curr.assign(10, NAN);
  const MotionClass unknown = classify_motion(object, SE3(), 0.1, {});
  EXPECT_TRUE(std::isnan(unknown.moving_share));
  EXPECT_TRUE(unknown.is_dynamic);
  EXPECT_EQ(unknown.n_points, 0);
}

}  // namespace
}  // namespace sextant
