#include "sextant/geometry/pose_interpolation.h"

#include <gmock/gmock.h>

#include "sextant/geometry/testing.h"

namespace sextant {
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
  for (const double angle : {3.0, 3.4}) {  // quaternions of opposite sign
    s.add(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {0, 0, 0});
    s.stamps_s.push_back(angle);
  }
  const double middle[] = {3.2};
  EXPECT_THAT(interpolate_poses(s, middle, 1).poses.rotations[0],
              EigenNear(Eigen::AngleAxisd(3.2, Eigen::Vector3d::UnitZ()).toRotationMatrix(), 1e-14));
}

TEST(PoseInterpolation, ARecordedPoseIsTakenAsItIs) {
  PoseSeries s = turning({0, 1, 5}, 0.8, 5);
  s.rotations[1](0, 0) += 1e-7;  // off SO(3), as files round
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
