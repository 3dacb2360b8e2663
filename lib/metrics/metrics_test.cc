// Tests of every metric against cases worked by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/definitions.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {
namespace {

constexpr double rad = std::numbers::pi / 180;
const Eigen::Vector3d zero = Eigen::Vector3d::Zero();

SE3 yaw(double degrees, const Eigen::Vector3d& t = zero) { return {so3_exp({0, degrees * rad, 0}), t}; }

TEST(PoseChange, TranslationAndAngle) {
  // E = Xhat^-1 X: translations 3 and 4 m apart along two axes, 0.25 deg between the rotations.
  const PoseChangeError e = pose_change_error(yaw(10, {1, 2, 3}), yaw(10.25, {4, 6, 3}));
  EXPECT_NEAR(e.Et_m, 5, 1e-12);
  EXPECT_NEAR(e.ER_deg, 0.25, 1e-12);
}

TEST(PoseChange, TinyAnglesAreNotQuantised) {
  // The arc cosine of the trace in single precision cannot distinguish these angles from 0 or 0.028 deg.
  for (const double angle : {1e-9, 1e-6, 1e-3, 0.01}) {
    EXPECT_NEAR(pose_change_error(yaw(angle), yaw(0)).ER_deg, angle, 1e-7 * angle + 1e-14);
  }
}

TEST(PoseChange, HalfTurnAndZero) {
  EXPECT_NEAR(pose_change_error(yaw(180), yaw(0)).ER_deg, 180, 1e-9);
  EXPECT_EQ(pose_change_error(yaw(7, {1, 2, 3}), yaw(7, {1, 2, 3})).Et_m, 0);
}

TEST(WorldMotion, OfAStaticPointIsTheIdentity) {
  const SE3 T_world_prev = yaw(20, {5, 0, 1});
  const SE3 T_world_curr = yaw(25, {6, 0, 2});
  const SE3 X = T_world_curr.inverse() * T_world_prev;
  EXPECT_LT(world_motion(T_world_prev, T_world_curr, X).log().norm(), 1e-12);
}

TEST(WorldMotion, GrowsWithTheDistanceToTheOrigin) {
  // An error of 0.1 deg in the camera frame causes 100 m * sin(0.1 deg) if the world's origin is 100 m away.
  const SE3 far(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 100));
  const SE3 truth = world_motion(far, far, yaw(0));
  const SE3 estimate = world_motion(far, far, yaw(0.1));
  EXPECT_NEAR(pose_change_error(estimate, truth).Et_m, 2 * 100 * std::sin(0.05 * rad), 1e-9);
  EXPECT_NEAR(pose_change_error(yaw(0.1), yaw(0)).Et_m, 0, 1e-12);
}

TEST(BodyMotion, RotationAboutTheBodyHasNoTranslationThere) {
  const SE3 L = yaw(30, {2, 1, 10});
  const SE3 H = L * yaw(5) * L.inverse();  // rotates on the spot
  EXPECT_GT(H.translation().norm(), 0.5);
  EXPECT_LT((body_motion(H, L) * yaw(5).inverse()).log().norm(), 1e-12);
}

TEST(Velocity, PureTranslation) {
  const SE3 H(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, 0, 0.4));
  EXPECT_NEAR(velocity_kmh(H, {7, 8, 9}, 0.1), 18, 1e-12);  // 0.5 m in 0.1 s = 5 m/s
}

TEST(Velocity, IsTheFormulaOfThePaper) {
  const SE3 H = yaw(3, {0.2, 0.1, 1.0});
  const Eigen::Vector3d c(2, 1, 12);
  const Eigen::Matrix3d R = H.rotation().toRotationMatrix();
  const double expected = (H.translation() - (Eigen::Matrix3d::Identity() - R) * c).norm() / 0.1 * 3.6;
  EXPECT_NEAR(velocity_kmh(H, c, 0.1), expected, 1e-12);
  EXPECT_EQ(velocity_error_kmh(50, 53), 3);
}

TEST(Velocity, TurningOnTheSpotIsStandingStill) {
  const SE3 L = yaw(0, {2, 1, 10});
  EXPECT_NEAR(velocity_kmh(L * yaw(5) * L.inverse(), {2, 1, 10}, 0.1), 0, 1e-9);
}

TEST(FlowError, MeansOverValidPoints) {
  const std::vector<double> u = {3, 0, NAN, 1};
  const std::vector<double> v = {4, 0, 0, 1};
  const std::vector<double> tu = {0, 0, 0, NAN};
  const std::vector<double> tv = {0, 2, 0, 1};
  const FlowError e = flow_error(u, v, tu, tv);
  EXPECT_EQ(e.n, 2);
  EXPECT_DOUBLE_EQ(e.epe_px, (5.0 + 2.0) / 2);
  EXPECT_DOUBLE_EQ(e.x_px, 1.5);
  EXPECT_DOUBLE_EQ(e.y_px, 3.0);
}

TEST(FlowError, NothingValidIsNotZero) {
  const std::vector<double> nothing;
  EXPECT_TRUE(std::isnan(flow_error(nothing, nothing, nothing, nothing).epe_px));
}

TEST(InducedFlow, ForwardMotionExpandsFromThePrincipalPoint) {
  Correspondences points;
  points.push_back(700, 200, 10, 0, 0);
  points.push_back(600, 180, 10, 0, 0);
  points.push_back(700, 200, 0.5, 0, 0);  // is behind the camera after the motion
  const SE3 X(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -2));
  const PointFlow flow = induced_flow({700, 700, 600, 180}, X, points);
  EXPECT_NEAR(flow.u[0], 100.0 * 10 / 8 - 100, 1e-12);
  EXPECT_NEAR(flow.v[0], 20.0 * 10 / 8 - 20, 1e-12);
  EXPECT_NEAR(flow.u[1], 0, 1e-12);
  EXPECT_TRUE(std::isnan(flow.u[2]));
}

TEST(ClassificationCounts, PositiveIsDynamic) {
  ClassificationCounts counts;
  EXPECT_FALSE(counts.precision().has_value());
  EXPECT_FALSE(counts.recall().has_value());
  counts.add(true, true);
  counts.add(true, true);
  counts.add(true, false);
  counts.add(false, true);
  counts.add(false, true);
  counts.add(false, false);
  EXPECT_EQ(counts.true_positive, 2);
  EXPECT_EQ(counts.false_positive, 1);
  EXPECT_EQ(counts.false_negative, 2);
  EXPECT_EQ(counts.true_negative, 1);
  EXPECT_DOUBLE_EQ(*counts.precision(), 2.0 / 3);
  EXPECT_DOUBLE_EQ(*counts.recall(), 0.5);
}

TEST(Presets, AreFoundByName) {
  EXPECT_EQ(find_preset("paper").aggregate, Aggregate::mean);
  EXPECT_EQ(find_preset("dynosam_rme").aggregate, Aggregate::rmse);
  EXPECT_THROW(find_preset("papers"), Error);
  EXPECT_EQ(metric_presets().size(), 5U);
}

}  // namespace
}  // namespace sextant
