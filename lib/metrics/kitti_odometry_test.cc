#include "sextant/metrics/kitti_odometry.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

PoseSeries straight(int n, double step_m, double turn_rad) {
  PoseSeries s;
  for (int i = 0; i < n; ++i)
    s.add(Eigen::AngleAxisd(i * turn_rad, Eigen::Vector3d::UnitX()).toRotationMatrix(), {i * step_m, 0, 0});
  return s;
}

TEST(KittiOdometry, ScaleErrorIsItsPercentage) {
  // 2 % too long; the stretches of 100 m end at the first pose beyond, 101 m.
  const KittiOdometryErrors e = kitti_odometry_errors(straight(1001, 1.02, 0), straight(1001, 1, 0));
  EXPECT_EQ(e.by_length.front().n, 90);  // starts 0, 10, .. 890
  EXPECT_NEAR(*e.by_length.front().translation_percent, 2 * 1.01, 1e-9);
  EXPECT_NEAR(*e.by_length.back().translation_percent, 2 * 801. / 800, 1e-9);
  EXPECT_EQ(*e.all.rotation_deg_per_m, 0);
  EXPECT_EQ(e.path_m, 1000);
}

TEST(KittiOdometry, RotationIsPerMetre) {
  const KittiOdometryErrors e = kitti_odometry_errors(straight(151, 1, 1e-3), straight(151, 1, 0));
  EXPECT_EQ(e.all.n, 5);  // 0, 10, .. 40
  EXPECT_NEAR(*e.all.rotation_deg_per_m, 1e-3 * 180 / EIGEN_PI * 1.01, 1e-12);
}

TEST(KittiOdometry, ShortRecordingsHaveNone) {
  const KittiOdometryErrors e = kitti_odometry_errors(straight(101, 1.1, 0), straight(101, 1, 0));
  EXPECT_EQ(e.all.n, 0);
  EXPECT_FALSE(e.all.translation_percent);
  EXPECT_FALSE(e.by_length.front().rotation_deg_per_m);
}

}  // namespace
}  // namespace sextant
