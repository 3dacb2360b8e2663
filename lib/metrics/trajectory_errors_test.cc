#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace sextant {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

/// A path along x with one pose per metre and 0.1 s, rotating by 10 deg per pose.
PoseSeries steady(int n) {
  PoseSeries s;
  for (int i = 0; i < n; ++i) {
    s.add(Eigen::AngleAxisd(i * EIGEN_PI / 18, Eigen::Vector3d::UnitY()).toRotationMatrix(),
          Eigen::Vector3d(i, 0, 0));
    s.stamps_s.push_back(0.1 * i);
  }
  return s;
}

std::vector<PosePair> pairs(const PoseSeries& series, const std::string& text, bool all) {
  PairSelection s = PairSelection::parse(text);
  s.all_pairs = all;
  return select_pairs(series, s);
}

TEST(PosePairs, Frames) {
  EXPECT_THAT(pairs(steady(6), "2f", false), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(pairs(steady(6), "3f", true), ElementsAre(Pair(0, 3), Pair(1, 4), Pair(2, 5)));
}

TEST(PosePairs, MetresBeginWhereTheDistanceIsFirstReached) {
  EXPECT_THAT(pairs(steady(9), "2.5m", false), ElementsAre(Pair(3, 6)));
  EXPECT_THAT(pairs(steady(6), "3m", true), ElementsAre(Pair(0, 3), Pair(1, 4), Pair(2, 5)));
}

TEST(PosePairs, MetresOfAStandstillTakeTheFirstPose) {
  PoseSeries s = steady(4);
  for (int i = 0; i < 3; ++i) s.add(s.rotations[3], s.positions_m[3]);  // poses 4..6 stand at pose 3
  s.stamps_s.clear();
  EXPECT_THAT(pairs(s, "2m", true), ElementsAre(Pair(0, 2), Pair(1, 3)));
}

TEST(PosePairs, Angles) {
  EXPECT_THAT(pairs(steady(6), "19.9deg", false), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(pairs(steady(5), "30deg", true), ElementsAre(Pair(0, 3), Pair(1, 4)));
  EXPECT_THAT(pairs(steady(5), "0.5236rad", true), ElementsAre(Pair(0, 3), Pair(1, 4)));
}

TEST(PosePairs, AnglesNeedRotations) {
  PoseSeries positions = steady(5);
  positions.rotations.clear();
  EXPECT_THROW(pairs(positions, "5deg", false), Error);
  EXPECT_THROW(pairs(positions, "5deg", true), Error);
  EXPECT_FALSE(pairs(positions, "1f", false).empty());
}

TEST(PosePairs, Seconds) {
  EXPECT_THAT(pairs(steady(6), "0.2s", false), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(pairs(steady(5), "0.3s", true), ElementsAre(Pair(0, 3), Pair(1, 4)));
  PoseSeries no_stamps = steady(5);
  no_stamps.stamps_s.clear();
  EXPECT_THROW(pairs(no_stamps, "0.2s", false), Error);
}

TEST(PosePairs, NoPairIsAnError) {
  EXPECT_THROW(pairs(steady(5), "5f", false), Error);
  EXPECT_THROW(pairs(steady(5), "100m", false), Error);
  EXPECT_THROW(pairs(steady(5), "100m", true), Error);
  EXPECT_THROW(pairs(steady(5), "170deg", true), Error);
}

TEST(PosePairs, ParseRefusesInvalidDistances) {
  for (const char* text : {"", "f", "1", "1x", "0f", "-1m", "1.5f", "nanm", "200deg", "4rad", "1 f"})
    EXPECT_THROW(PairSelection::parse(text), Error) << text;
  EXPECT_EQ(PairSelection::parse("0.5rad").text(), "0.5rad");
}

}  // namespace

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

TEST(TrajectoryAlignment, YawRotatesOnlyAboutUp) {
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

namespace {

PoseSeries straight(int n, double step_m, double turn_rad) {
  PoseSeries s;
  for (int i = 0; i < n; ++i)
    s.add(Eigen::AngleAxisd(i * turn_rad, Eigen::Vector3d::UnitX()).toRotationMatrix(), {i * step_m, 0, 0});
  return s;
}

TEST(KittiOdometry, ScaleErrorIsItsPercentage) {
  // 2 % too long; the segments of 100 m end at the first pose beyond, 101 m.
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
