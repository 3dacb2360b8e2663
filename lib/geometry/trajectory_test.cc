#include "sextant/geometry/trajectory.h"

#include <gtest/gtest.h>

#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

TEST(Trajectory, AMissingFrameHasNoPose) {
  Trajectory trajectory;
  EXPECT_TRUE(trajectory.empty());
  trajectory.set(3, SE3(Eigen::Quaterniond::Identity(), {0, 0, 3}));
  EXPECT_FALSE(trajectory.empty());
  EXPECT_TRUE(trajectory.has(3));
  EXPECT_FALSE(trajectory.has(4));
  EXPECT_FALSE(trajectory.pose(4).has_value());
  EXPECT_FALSE(trajectory.motion(3, 4).has_value());
  EXPECT_FALSE(trajectory.motion(2, 3).has_value());
}

TEST(Trajectory, MotionIsThePoseOfTheCurrentInThePrevious) {
  // The camera turns right (about y, down) by 90 degrees at (0, 0, 5) and has moved there straight ahead.
  const Eigen::Quaterniond right(Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitY()));
  Trajectory trajectory;
  trajectory.set(0, SE3(Eigen::Quaterniond::Identity(), {0, 0, 4}));
  trajectory.set(1, SE3(right, {0, 0, 5}));
  const std::optional<SE3> T_prev_curr = trajectory.motion(0, 1);
  ASSERT_TRUE(T_prev_curr.has_value());
  EXPECT_THAT(*T_prev_curr, SE3Near(SE3(right, {0, 0, 1}), 1e-15));
  // What lies 2 m ahead of the turned camera lies 2 m to the right of the old one.
  EXPECT_THAT(*T_prev_curr * Eigen::Vector3d(0, 0, 2), EigenNear(Eigen::Vector3d(2, 0, 1), 1e-15));
  EXPECT_THAT(*trajectory.motion(1, 0), SE3Near(T_prev_curr->inverse(), 1e-15));
}

TEST(Trajectory, SetReplaces) {
  Trajectory trajectory;
  trajectory.set(0, SE3());
  trajectory.set(0, SE3(Eigen::Quaterniond::Identity(), {1, 0, 0}));
  EXPECT_EQ(trajectory.poses().size(), 1U);
  EXPECT_EQ(trajectory.pose(0)->translation().x(), 1.0);
}

}  // namespace
}  // namespace sextant
