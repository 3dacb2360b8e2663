#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/geometry/testing.h"
#include "sextant/geometry/trajectory.h"

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
  // The camera turns right by 90 degrees (about y, which points down) and ends at (0, 0, 5), straight ahead
  // of its start.
  const Eigen::Quaterniond right(Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitY()));
  Trajectory trajectory;
  trajectory.set(0, SE3(Eigen::Quaterniond::Identity(), {0, 0, 4}));
  trajectory.set(1, SE3(right, {0, 0, 5}));
  const std::optional<SE3> T_prev_curr = trajectory.motion(0, 1);
  ASSERT_TRUE(T_prev_curr.has_value());
  EXPECT_THAT(*T_prev_curr, SE3Near(SE3(right, {0, 0, 1}), 1e-15));
  // A point 2 m ahead of the turned camera lies 2 m to the right of its previous optical axis.
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

namespace {

using testing::ElementsAre;

PoseSeries turning(std::initializer_list<double> stamps, double rate_rad_s, double speed_mps) {
  PoseSeries s;
  for (const double t : stamps) {
    s.add(Eigen::AngleAxisd(rate_rad_s * t, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix(),
          {speed_mps * t, 1, -2 * t});
    s.stamps_s.push_back(t);
  }
  return s;
}

TEST(PoseInterpolation, ConstantMotionIsMetExactly) {
  const double times[] = {0.25, 1.0, 1.9, 2.5};
  const InterpolatedPoses found = interpolate_poses(turning({0, 1, 2, 3}, 0.8, 5), times, 1.0);
  ASSERT_EQ(found.poses.size(), 4);
  const PoseSeries expected = turning({0.25, 1.0, 1.9, 2.5}, 0.8, 5);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_THAT(found.poses.rotations[i], EigenNear(expected.rotations[i], 1e-14)) << i;
    EXPECT_THAT(found.poses.positions_m[i], EigenNear(expected.positions_m[i], 1e-14)) << i;
  }
  EXPECT_THAT(found.rows, ElementsAre(0, 1, 2, 2));
  EXPECT_EQ(found.largest_gap_s, 1);
}

TEST(PoseInterpolation, TakesTheShorterWayRound) {
  PoseSeries s;
  for (const double angle : {3.0, 3.4}) {  // the quaternions have opposite signs
    s.add(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {0, 0, 0});
    s.stamps_s.push_back(angle);
  }
  const double middle[] = {3.2};
  EXPECT_THAT(interpolate_poses(s, middle, 1).poses.rotations[0],
              EigenNear(Eigen::AngleAxisd(3.2, Eigen::Vector3d::UnitZ()).toRotationMatrix(), 1e-14));
}

TEST(PoseInterpolation, ARecordedPoseIsTakenAsItIs) {
  PoseSeries s = turning({0, 1, 5}, 0.8, 5);
  s.rotations[1](0, 0) += 1e-7;  // off SO(3), as after rounding in a file
  const double times[] = {1.0};
  const InterpolatedPoses found = interpolate_poses(s, times, 0.1);
  EXPECT_EQ(found.poses.rotations.at(0), s.rotations[1]);
  EXPECT_EQ(found.largest_gap_s, 0);
}

TEST(PoseInterpolation, NothingOutsideAndNoLongGap) {
  const double times[] = {-0.1, 0.5, 1.5, 3.0, 4.5};
  const InterpolatedPoses found = interpolate_poses(turning({0, 1, 4}, 0.1, 1), times, 1.0);
  EXPECT_THAT(found.asked, ElementsAre(1));
  EXPECT_EQ(found.n_outside, 2);
  EXPECT_EQ(found.n_in_longer_gaps, 2);
}

}  // namespace

}  // namespace sextant
