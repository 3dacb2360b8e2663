#include "sextant/estimator/pipeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
  // Static points observed by a camera that moves 1 m forward.
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

MotionEstimate known_to(const SE3& T_curr_prev, const Vector6d& deviations) {
  MotionEstimate estimate;
  estimate.status = Status::ok;
  estimate.T_curr_prev = T_curr_prev;
  estimate.covariance = deviations.cwiseAbs2().asDiagonal();
  return estimate;
}

const MotionEstimate background_at_rest = known_to(SE3(), Vector6d::Constant(1e-6));

// Worked by hand: sigma 0.01 m, a displacement of 0.09 m, of which 0.03 m are within 0.3 m/s.
TEST(MotionLikelihood, CountsDeviationsBeyondTheSmallestSpeed) {
  ClassificationOptions options;
  options.test = MotionTest::likelihood;
  options.smallest_speed_mps = 0.3;
  Vector6d deviations = Vector6d::Constant(1e-6);
  deviations.head<3>().setConstant(0.01);
  const MotionEstimate body = known_to(SE3(Eigen::Quaterniond::Identity(), {0, 0, 0.09}), deviations);
  const auto motion = test_motion(body, background_at_rest, {0, 0, 0}, 0.1, options);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->statistic, 6, 1e-3);
  EXPECT_TRUE(motion->is_dynamic);
  // chi-square with 3 degrees of freedom: 16.27 at 99.9 %.
  EXPECT_NEAR(motion->detectable_mps, 0.3 + std::sqrt(16.27) * 0.1, 0.005);
  const auto slow = test_motion(known_to(SE3(Eigen::Quaterniond::Identity(), {0.02, 0, 0.02}), deviations),
                                background_at_rest, {0, 0, 0}, 0.1, options);
  ASSERT_TRUE(slow);
  EXPECT_EQ(slow->statistic, 0);
  EXPECT_FALSE(slow->is_dynamic);
}

// A displacement of the same length along the direction with the largest variance.
TEST(MotionLikelihood, WeighsDirectionsByTheirCovariance) {
  Vector6d deviations = Vector6d::Constant(1e-6);
  deviations.head<3>() << 0.01, 0.01, 0.1;
  const auto at = [&](double x, double z) {
    return *test_motion(known_to(SE3(Eigen::Quaterniond::Identity(), {x, 0, z}), deviations),
                        background_at_rest, {0, 0, 0}, 0.1, {});
  };
  EXPECT_TRUE(at(0.2, 0).is_dynamic);
  EXPECT_FALSE(at(0, 0.2).is_dynamic);
}

// A stationary body, measured with errors of its stated covariance, is classified dynamic at the stated false
// alarm rate.
TEST(MotionLikelihood, FalseAlarmsComeAtTheStatedRate) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  ClassificationOptions options;
  options.false_alarm_rate = 0.05;
  options.smallest_speed_mps = 1e-9;
  const Eigen::Vector3d centre(1, 0.5, 15);
  Vector6d deviations;
  deviations << 0.02, 0.03, 0.05, 0.002, 0.004, 0.003;
  constexpr int n = 4000;
  int alarms = 0;
  for (int k = 0; k < n; ++k) {
    Vector6d error;
    for (int i = 0; i < 6; ++i) error[i] = deviations[i] * normal(engine);
    const auto motion =
        test_motion(known_to(SE3::exp(error), deviations), background_at_rest, centre, 0.1, options);
    ASSERT_TRUE(motion);
    alarms += motion->is_dynamic ? 1 : 0;
  }
  // Three standard errors, plus the second-order effect of rotations.
  EXPECT_NEAR(alarms / static_cast<double>(n), 0.05, 0.012);
}

TEST(MotionLikelihood, HasNoResultWithoutACovariance) {
  MotionEstimate body = background_at_rest;
  body.covariance.setConstant(INFINITY);
  EXPECT_FALSE(test_motion(body, background_at_rest, {0, 0, 0}, 0.1, {}));
  body.covariance.setZero();
  MotionEstimate background = body;
  EXPECT_FALSE(test_motion(body, background, {0, 0, 0}, 0.1, {}));
}

}  // namespace
}  // namespace sextant
