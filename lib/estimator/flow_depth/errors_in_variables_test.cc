// Tests of the prior of weakly observable directions, from matrices alone. Tests of complete estimates:
// joint_flow_depth_test.cc.

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "sextant/estimator/flow_depth/errors_in_variables.h"

namespace sextant {
namespace {

constexpr size_t n_points = 200;

/// H is the identity, lambda belongs to the first direction; the other five are determined.
DepthInformation with_lambda(double lambda) {
  DepthInformation out{Matrix6d::Identity(), Matrix6d::Zero()};
  out.errors(0, 0) = 1 - lambda;
  return out;
}

MotionPrior hold(double lambda, double measured, double gradient) {
  const DepthInformation of_mean{measured * Matrix6d::Identity(), Matrix6d::Zero()};
  Vector6d along = Vector6d::Zero();
  along[0] = gradient;
  return weak_direction_prior(SE3(), with_lambda(lambda), of_mean, along, n_points);
}

// The noise appears larger than the relief, so that the cost alone has no minimum in this direction.
TEST(WeakDirections, UseThePriorWithoutSignificantRelief) {
  for (const double lambda : {-3.0, -0.2, 0.0}) {
    for (const double measured : {1.0, 0.3, 0.01}) {  // also with an imprecise mean
      const MotionPrior prior = hold(lambda, measured, 1);
      const DepthInformation at = with_lambda(lambda);
      const Matrix6d curvature = at.total - at.errors + prior.precision;
      EXPECT_EQ(curvature.llt().info(), Eigen::Success) << lambda << " " << measured;
      const Matrix6d covariance = motion_covariance(at, prior);
      ASSERT_TRUE(covariance.allFinite()) << lambda << " " << measured;
      // The noise does not explain the distance of the two estimates: all of it counts as bias.
      const double least = std::sqrt(18.0 / n_points);
      EXPECT_NEAR(covariance(0, 0), 1 / (least * least) + 1 / measured, 0.01) << lambda << " " << measured;
      const double others = prior.precision.bottomRightCorner<5, 5>().norm();
      EXPECT_NEAR(others, 0, 1e-9);
    }
  }
}

// The squared bias is the squared difference, 4 here, minus the part explained by its variance, 2.
TEST(WeakDirections, BiasFollowsFromTheDifferenceOfTheEstimates) {
  constexpr double lambda = 0.5;
  DepthInformation of_mean = with_lambda(lambda);
  of_mean.total *= 0.5;
  const auto bias2 = [&](double difference) {
    Vector6d gradient = Vector6d::Zero();
    gradient[0] = lambda * difference;
    return weak_direction_prior(SE3(), with_lambda(lambda), of_mean, gradient, n_points).bias(0, 0);
  };
  EXPECT_NEAR(bias2(2), 2, 1e-12);
  EXPECT_EQ(bias2(1), 0);
}

TEST(WeakDirections, HaveNoPriorIfTheStructuredEstimateIsAsGood) { EXPECT_FALSE(hold(0.9, 0.5, 1).holds()); }

}  // namespace

}  // namespace sextant
