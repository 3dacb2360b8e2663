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

MotionPrior hold(double lambda, double measured, double gradient, Scores scores) {
  const DepthInformation of_mean{measured * Matrix6d::Identity(), Matrix6d::Zero()};
  Vector6d along = Vector6d::Zero();
  along[0] = gradient;
  return weak_direction_prior(SE3(), with_lambda(lambda), of_mean, along, n_points, scores);
}

// The noise appears larger than the relief, so that the cost alone has no minimum in this direction.
TEST(WeakDirections, UseThePriorWithoutSignificantRelief) {
  for (const Scores scores : {Scores::independent, Scores::correlated}) {
    for (const double lambda : {-3.0, -0.2, 0.0}) {
      for (const double measured : {1.0, 0.3, 0.01}) {  // also with an imprecise mean
        const MotionPrior prior = hold(lambda, measured, 1, scores);
        const DepthInformation at = with_lambda(lambda);
        const Matrix6d curvature = at.total - at.errors + prior.precision;
        EXPECT_EQ(curvature.llt().info(), Eigen::Success) << lambda << " " << measured;
        const Matrix6d covariance = motion_covariance(at, prior);
        ASSERT_TRUE(covariance.allFinite()) << lambda << " " << measured;
        // The error of the regularised estimate is at most the distance of the two estimates.
        const double least = std::sqrt(18.0 / n_points);
        EXPECT_GE(covariance(0, 0), 1 / (least * least)) << lambda << " " << measured;
        const double others = prior.precision.bottomRightCorner<5, 5>().norm();
        EXPECT_NEAR(others, 0, 1e-9);
      }
    }
  }
}

// The squared bias is the squared difference, 4 here, minus the part explained by its variance, 2: all of it
// for independent errors, a tenth of it for correlated ones.
TEST(WeakDirections, BiasFollowsFromTheDifferenceOfTheEstimates) {
  constexpr double lambda = 0.5, difference = 2;
  DepthInformation of_mean = with_lambda(lambda);
  of_mean.total *= 0.5;
  Vector6d gradient = Vector6d::Zero();
  gradient[0] = lambda * difference;
  const auto bias2 = [&](Scores scores) {
    return weak_direction_prior(SE3(), with_lambda(lambda), of_mean, gradient, n_points, scores).bias(0, 0);
  };
  EXPECT_NEAR(bias2(Scores::independent), 2, 1e-12);
  EXPECT_NEAR(bias2(Scores::correlated), 3.8, 1e-12);
}

TEST(WeakDirections, HaveNoPriorIfTheStructuredEstimateIsAsGood) {
  EXPECT_FALSE(hold(0.9, 0.5, 1, Scores::independent).holds());
  EXPECT_FALSE(hold(0.9, 0.5, 1, Scores::correlated).holds());
}

}  // namespace

}  // namespace sextant
