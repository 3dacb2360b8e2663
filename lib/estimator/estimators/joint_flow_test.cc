#include "sextant/estimator/estimators/joint_flow.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sextant/estimator/reference/ceres_reference.h"
#include "sextant/estimator/reference/testing.h"
#include "sextant/estimator/solvers/robust_kernel.h"

namespace sextant {
namespace {

struct Case {
  const char* name;
  RandomProblemOptions problem;
  JointFlowOptions options;
};

class JointFlowAgainstCeres : public ::testing::TestWithParam<Case> {};

TEST_P(JointFlowAgainstCeres, SamePoseAndFlows) {
  expect_same_optimum<JointFlow, JointFlowCeres>(GetParam().problem, GetParam().options, 8, 1e-9);
}

TEST_P(JointFlowAgainstCeres, EqualsMotionOnlyWithTheEffectiveKernel) {
  const Case& c = GetParam();
  const HuberKernel kernel = c.options.effective_kernel();
  MotionOnlyOptions matched{.sigma_px = kernel.sigma_px, .huber = kernel.threshold};
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const RandomProblem random = make_random_problem(seed, c.problem);
    const MotionEstimate joint = JointFlow(c.options).estimate(random.problem, random.start);
    const MotionEstimate motion = MotionOnly(matched).estimate(random.problem, random.start);
    const MotionEstimate motion_ceres = MotionOnlyCeres(matched).estimate(random.problem, random.start);
    EXPECT_LT(pose_difference(joint.T_curr_prev, motion.T_curr_prev), 1e-9) << seed;
    // The result depends on the optimum and not on the starting motion.
    const StartingPoint elsewhere{random.T_curr_prev, random.start.inliers};
    const MotionEstimate again = MotionOnly(matched).estimate(random.problem, elsewhere);
    EXPECT_LT(pose_difference(joint.T_curr_prev, again.T_curr_prev), 1e-9) << seed;
    EXPECT_LT(pose_difference(joint.T_curr_prev, motion_ceres.T_curr_prev), 1e-8) << seed;
    EXPECT_NEAR(joint.cost, motion_ceres.cost, 1e-9 * (1 + joint.cost)) << seed;
  }
}

JointFlowOptions with(double sigma_projection, double sigma_flow, double huber_projection,
                      double huber_flow) {
  JointFlowOptions options{.sigma_projection_px = sigma_projection,
                           .sigma_flow_px = sigma_flow,
                           .huber_projection = huber_projection,
                           .huber_flow = huber_flow};
  return options;
}

INSTANTIATE_TEST_SUITE_P(
    , JointFlowAgainstCeres,
    ::testing::Values(
        Case{"Clean", {.n_points = 300}, {}}, Case{"SixPoints", {.n_points = 6}, {}},
        Case{"Twenty", {.n_points = 20, .outlier_share = 0.2}, {}},
        Case{"Outliers30Percent", {.n_points = 800, .outlier_share = 0.3}, {}},
        Case{"FlowCapsFirst", {.n_points = 500, .outlier_share = 0.2}, with(0.4, 0.8, 1.345, 1.345)},
        Case{"ProjectionCapsFirst", {.n_points = 500, .outlier_share = 0.2}, with(1.0, 0.5, 1.0, 2.0)},
        Case{"PublishedCamera",
             {.n_points = 500, .outlier_share = 0.1},
             with(std::sqrt(10), std::sqrt(1 / 0.3), 0.632, 1e6)},
        Case{"SmallPatch",
             {.n_points = 400,
              .outlier_share = 0.1,
              .near_m = 20,
              .far_m = 22,
              .spread = 0.05,
              .start_error = 0.005},
             {}},
        Case{"FiveThousand", {.n_points = 5000, .outlier_share = 0.2}, {}}),
    [](const auto& test) { return test.param.name; });

double cost(const HuberKernel& kernel, double norm_px) {
  return HuberAt<double>(Huber<double>(kernel.sigma_px, kernel.threshold), norm_px * norm_px).cost;
}

// By definition: no split of a residual has a lower cost than that of the closed form.
TEST(InfimalConvolution, IsTheMinimumOverAllSplits) {
  for (const auto& [projection, flow] : {std::pair<HuberKernel, HuberKernel>{{0.4, 1.345}, {0.8, 1.345}},
                                         {{1.0, 1.0}, {0.5, 2.0}},
                                         {{1.0, 1.0}, {2.0, 2.0}},
                                         {{3.0, 0.6}, {1.8, std::numeric_limits<double>::infinity()}}}) {
    const HuberKernel joint = infimal_convolution(projection, flow);
    for (const double length : {0.0, 0.1, 0.5, 0.9, 1.5, 4.0, 20.0}) {
      const Eigen::Vector2d r = length * Eigen::Vector2d(0.6, -0.8);
      const Eigen::Vector2d b = split_residual(r, projection, flow);
      const double split_cost = cost(projection, (r - b).norm()) + cost(flow, b.norm());
      EXPECT_NEAR(split_cost, cost(joint, length), 1e-12 * (1 + split_cost)) << length;
      double smallest = split_cost;
      for (double along = -1.0; along <= 2.0; along += 0.01) {
        for (double across = -0.5; across <= 0.5; across += 0.05) {
          const Eigen::Vector2d other = along * r + across * Eigen::Vector2d(0.8, 0.6);
          smallest = std::min(smallest, cost(projection, (r - other).norm()) + cost(flow, other.norm()));
        }
      }
      EXPECT_GE(smallest, cost(joint, length) - 1e-12 * (1 + split_cost)) << length;
    }
  }
}

TEST(ReprojectionSolver, GradientAndHessianAgainstFiniteDifferences) {
  const RandomProblem random = make_random_problem(3, {.n_points = 37, .outlier_share = 0.3});
  const HuberKernel kernel{0.7, 1.345};
  const ReprojectionData data(random.problem);
  const NormalEquations at = accumulate(data, random.start.T_curr_prev, kernel);
  const double h = 1e-6;
  for (int k = 0; k < 6; ++k) {
    Vector6d xi = Vector6d::Zero();
    xi[k] = h;
    const NormalEquations plus = accumulate(data, SE3::exp(xi) * random.start.T_curr_prev, kernel);
    const NormalEquations minus = accumulate(data, SE3::exp(-xi) * random.start.T_curr_prev, kernel);
    EXPECT_NEAR((plus.cost - minus.cost) / (2 * h), at.gradient[k], 1e-6 * at.gradient.norm()) << k;
    // The Gauss-Newton Hessian omits the curvature of the projection: a few percent with these residuals.
    const Vector6d column = (plus.gradient - minus.gradient) / (2 * h);
    EXPECT_LT((column - at.hessian.col(k)).norm(), 0.1 * at.hessian.col(k).norm()) << k;
  }
}

TEST(ReprojectionSolver, NoiseFreeTruthIsFoundExactly) {
  const RandomProblem random = make_random_problem(5, {.n_points = 200, .flow_noise_px = 0});
  const MotionEstimate estimate = JointFlow({}).estimate(random.problem, random.start);
  ASSERT_EQ(estimate.status, Status::ok);
  EXPECT_LT(pose_difference(estimate.T_curr_prev, random.T_curr_prev), 1e-11);
}

TEST(ReprojectionSolver, PointBehindTheCameraIsRefused) {
  const RandomProblem random = make_random_problem(6, {.n_points = 50});
  const SE3 backwards(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -100));
  EXPECT_EQ(accumulate(ReprojectionData(random.problem), backwards, {}).cost,
            std::numeric_limits<double>::infinity());
  StartingPoint start = random.start;
  start.T_curr_prev = backwards;
  EXPECT_EQ(JointFlow({}).estimate(random.problem, start).status, Status::diverged);
}

TEST(ReprojectionSolver, InlierCountIsExactOrOutOfReach) {
  const RandomProblem random = make_random_problem(7, {.n_points = 1003, .outlier_share = 0.4});
  const RoughReprojectionData data(random.problem);
  std::vector<float> eu, ev;
  reprojection_errors(data, random.T_curr_prev, eu, ev);
  ASSERT_GE(std::min(eu.size(), ev.size()), 1003U);
  int expected = 0;
  for (size_t i = 0; i < 1003; ++i) expected += eu[i] * eu[i] + ev[i] * ev[i] <= 1 ? 1 : 0;
  EXPECT_EQ(count_inliers(data, random.T_curr_prev, 1.0, 0), expected);
  EXPECT_EQ(count_inliers(data, random.T_curr_prev, 1.0, expected), expected);
  EXPECT_LT(count_inliers(data, random.T_curr_prev, 1.0, 1004), 1004);
}

TEST(MotionOnly, CovarianceMatchesCeres) {
  const RandomProblem random = make_random_problem(8, {.n_points = 400});
  const MotionEstimate ours = MotionOnly({}).estimate(random.problem, random.start);
  const MotionEstimate reference = MotionOnlyCeres({}).estimate(random.problem, random.start);
  // Ceres weighs outer points by IRLS, this solver by the exact Hessian: equal except for the few points
  // beyond the threshold.
  EXPECT_LT((ours.covariance - reference.covariance).norm(), 0.1 * reference.covariance.norm());
}

TEST(MotionOnly, TooFewPoints) {
  RandomProblem random = make_random_problem(9, {.n_points = 20});
  random.start.inliers.assign(20, 0);
  random.start.inliers[3] = random.start.inliers[5] = 1;
  EXPECT_EQ(MotionOnly({}).estimate(random.problem, random.start).status, Status::too_few_points);
}

TEST(MotionOnly, IdenticalPointsAreUndetermined) {
  RandomProblem random = make_random_problem(10, {.n_points = 1});
  const Correspondences one = random.problem.points;
  for (int k = 0; k < 9; ++k) {
    random.problem.points.push_back(one.u[0], one.v[0], one.depth[0], one.flow_u[0], one.flow_v[0]);
  }
  random.start.inliers.assign(10, 1);
  EXPECT_EQ(MotionOnly({}).estimate(random.problem, random.start).status, Status::collinear);
}

}  // namespace
}  // namespace sextant
