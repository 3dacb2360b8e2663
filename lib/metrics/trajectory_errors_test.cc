#include "sextant/metrics/trajectory_errors.h"

#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {
namespace {

PoseSeries at(std::initializer_list<Eigen::Vector3d> positions, double turn_rad = 0) {
  PoseSeries s;
  for (const Eigen::Vector3d& p : positions)
    s.add(Eigen::AngleAxisd(turn_rad * static_cast<double>(s.size()), Eigen::Vector3d::UnitZ())
              .toRotationMatrix(),
          p);
  return s;
}

TEST(TrajectoryErrors, RelationsOfAKnownDifference) {
  const PoseSeries truth = at({{0, 0, 0}, {1, 0, 0}}), estimate = at({{0, 0, 0}, {1, 3, 4}}, 0.5);
  const std::vector<PosePair> pair = {{0, 1}};
  const auto ape = [&](PoseRelation r) { return absolute_errors(estimate, truth, r)[1]; };
  const auto rpe = [&](PoseRelation r) { return relative_errors(estimate, truth, pair, r)[0]; };
  const double chord = 2 * std::sqrt(2.0) * std::sin(0.25);  // ||R - I||_F of 0.5 rad
  EXPECT_NEAR(ape(PoseRelation::trans_part), 5, 1e-15);
  EXPECT_NEAR(ape(PoseRelation::angle_rad), 0.5, 1e-15);
  EXPECT_NEAR(ape(PoseRelation::angle_deg), 0.5 * 180 / EIGEN_PI, 1e-13);
  EXPECT_NEAR(ape(PoseRelation::rot_part), chord, 1e-15);
  EXPECT_NEAR(ape(PoseRelation::full), std::hypot(5, chord), 1e-14);
  EXPECT_NEAR(ape(PoseRelation::point_distance), 5, 1e-15);
  EXPECT_NEAR(rpe(PoseRelation::trans_part), 5, 1e-15);
  EXPECT_NEAR(rpe(PoseRelation::point_distance), std::sqrt(26) - 1, 1e-15);
}

TEST(TrajectoryErrors, RatioToTheDistanceTravelled) {
  const PoseSeries truth = at({{0, 0, 0}, {0, 2, 0}, {4, 2, 0}}),
                   estimate = at({{0, 0, 0}, {0, 0, 3}, {0, 0, 6}});
  const std::vector<PosePair> pairs = {{0, 1}, {1, 2}};
  const auto ratio = PoseRelation::point_distance_error_ratio;
  const std::vector<double> errors = relative_errors(estimate, truth, pairs, ratio);
  EXPECT_NEAR(errors[0], 50, 1e-12);
  EXPECT_NEAR(errors[1], 25, 1e-12);
  EXPECT_THROW(absolute_errors(estimate, truth, ratio), Error);
}

TEST(TrajectoryErrors, Statistics) {
  const std::vector<double> even = {4, 1, 3, 2};
  const ErrorStatistics s = error_statistics(even);
  EXPECT_EQ(s.median, 2.5);
  EXPECT_EQ(s.mean, 2.5);
  EXPECT_EQ(s.sse, 30);
  EXPECT_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_EQ(s.std, std::sqrt(1.25));
  EXPECT_EQ(s.min, 1);
  EXPECT_EQ(s.max, 4);
  EXPECT_EQ(error_statistics(std::vector<double>{3, 1, 2}).median, 2);
  EXPECT_THROW(error_statistics(std::vector<double>{1, INFINITY}), Error);
}

TEST(TrajectoryAlignment, StandingStillCannotBeAligned) {
  const PoseSeries still = at({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}),
                   moving = at({{0, 0, 0}, {1, 0, 1}, {0, 2, 5}});
  for (const Alignment how : {Alignment::se3, Alignment::sim3, Alignment::scale}) {
    PoseSeries estimate = still;
    EXPECT_THROW(align(estimate, moving, how), Error) << to_string(how);
  }
  PoseSeries estimate = still;
  align(estimate, moving, Alignment::origin);
  EXPECT_EQ(estimate.positions_m[2], moving.positions_m[0]);
}

TEST(TrajectoryAlignment, YawTurnsAboutUpAlone) {
  const PoseSeries truth = at({{0, 0, 0}, {3, 0, 1}, {3, 4, 2}, {1, 7, 0}}, 0.3);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                        tilt = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix();
  PoseSeries turned = truth, tilted = truth;
  for (size_t i = 0; i < truth.size(); ++i) {
    turned.positions_m[i] = turn * truth.positions_m[i] + Eigen::Vector3d(5, -6, 7);
    turned.rotations[i] = turn * truth.rotations[i];
    tilted.positions_m[i] = tilt * truth.positions_m[i];
  }
  const AlignmentResult r = align(turned, truth, Alignment::yaw, 0, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(r.ref_from_est.scale, 1);
  for (size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR((turned.positions_m[i] - truth.positions_m[i]).norm(), 0, 1e-14);
    EXPECT_NEAR((turned.rotations[i] - truth.rotations[i]).norm(), 0, 1e-14);
  }
  align(tilted, truth, Alignment::yaw, 0, Eigen::Vector3d::UnitZ());
  EXPECT_GT(absolute_errors(tilted, truth, PoseRelation::trans_part)[3], 0.1) << "a tilt stays an error";
  PoseSeries rising = at({{1, 1, 0}, {1, 1, 2}, {1, 1, 3}, {1, 1, 5}});
  EXPECT_THROW(align(rising, truth, Alignment::yaw, 0, Eigen::Vector3d::UnitZ()), Error);
}

TEST(TrajectoryAlignment, NamesRoundTrip) {
  for (const Alignment how : {Alignment::none, Alignment::origin, Alignment::se3, Alignment::sim3,
                              Alignment::scale, Alignment::yaw})
    EXPECT_EQ(from_name<Alignment>(to_string(how), "alignment"), how);
  EXPECT_THROW(from_name<Alignment>("sim2", "alignment"), Error);
  EXPECT_THROW(from_name<PoseRelation>("trans", "relation"), Error);
}

}  // namespace
}  // namespace sextant
