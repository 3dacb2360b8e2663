#include "sextant/estimator/joint_flow_depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sextant/estimator/ceres_flow_depth.h"
#include "sextant/estimator/joint_flow.h"
#include "sextant/estimator/local_planes.h"
#include "sextant/estimator/robust_start.h"
#include "sextant/estimator/testing.h"

namespace sextant {
namespace {

using testing::flow_difference;
using testing::make_random_problem;
using testing::pose_difference;
using testing::RandomProblem;
using testing::RandomProblemOptions;

struct Case {
  const char* name;
  RandomProblemOptions problem;
  JointFlowDepthOptions options;
};

JointFlowDepthOptions with(const char* robust, double sigma_u = 0, double sigma_v = 0, double delta_d = 0) {
  JointFlowDepthOptions options;
  options.robust = robust;
  options.sigma_flow_u_px = sigma_u;
  options.sigma_flow_v_px = sigma_v;
  options.delta_d_px = delta_d;
  options.plane_radius_px = 0;
  return options;
}

class JointFlowDepthAgainstCeres : public ::testing::TestWithParam<Case> {};

TEST_P(JointFlowDepthAgainstCeres, SameCostPoseAndFlows) {
  const Case& c = GetParam();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const RandomProblem random = make_random_problem(seed, c.problem);
    const MotionEstimate ours = JointFlowDepth(c.options).estimate(random.problem, random.start);
    const MotionEstimate reference = JointFlowDepthCeres(c.options).estimate(random.problem, random.start);
    ASSERT_EQ(ours.status, Status::ok) << seed;
    ASSERT_EQ(reference.status, Status::ok) << seed;
    EXPECT_LT(pose_difference(ours.T_curr_prev, reference.T_curr_prev), 1e-8) << seed;
    EXPECT_NEAR(ours.cost, reference.cost, 1e-8 * reference.cost) << seed;
    EXPECT_LT(flow_difference(ours, reference), 1e-6) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(
    , JointFlowDepthAgainstCeres,
    ::testing::Values(Case{"Plain", {.n_points = 300, .delta_d_px = 0.2}, with("none", 0.3, 0.3, 0.2)},
                      Case{"Anisotropic", {.n_points = 300, .delta_d_px = 0.2}, with("none", 0.5, 0.2, 0.2)},
                      Case{"BothDepths",
                           {.n_points = 300, .delta_d_px = 0.2, .depth_curr = true},
                           with("none", 0.3, 0.3, 0.2)},
                      Case{"Huber",
                           {.n_points = 300, .outlier_share = 0.2, .delta_d_px = 0.2},
                           with("huber", 0.3, 0.3, 0.2)},
                      Case{"HuberBothDepths",
                           {.n_points = 500, .outlier_share = 0.2, .delta_d_px = 0.2, .depth_curr = true},
                           with("huber", 0.3, 0.3, 0.1)},
                      Case{"Graduated",
                           {.n_points = 500, .outlier_share = 0.3, .delta_d_px = 0.2},
                           with("geman_mcclure_gnc", 0.3, 0.3, 0.2)},
                      Case{"Estimated",
                           {.n_points = 500, .outlier_share = 0.3, .delta_d_px = 0.2, .depth_curr = true},
                           with("geman_mcclure_gnc")},
                      Case{"Twenty", {.n_points = 20, .delta_d_px = 0.1}, with("huber", 0.3, 0.3, 0.1)},
                      Case{"FlowAlmostExact",
                           {.n_points = 300, .flow_noise_px = 0.02, .delta_d_px = 0.2},
                           with("none", 0.02, 0.02, 0.2)}),
    [](const auto& test) { return test.param.name; });

TEST(FlowDepthSolver, GradientAndHessianAgainstFiniteDifferences) {
  const RandomProblem random =
      make_random_problem(3, {.n_points = 61, .delta_d_px = 0.2, .depth_curr = true});
  FlowDepthData data(random.problem);
  NoiseLevels levels{
      .sigma_flow_u_px = 0.5, .sigma_flow_v_px = 0.3, .delta_d_px = 0.2, .delta_d_curr_px = 0.3};
  for (const DepthNoise noise : {DepthNoise::depth, DepthNoise::disparity}) {
    levels.depth_noise = noise;
    for (const auto kind :
         {RobustKernel::Kind::none, RobustKernel::Kind::huber, RobustKernel::Kind::geman_mcclure}) {
      const RobustKernel kernel{kind, 2.0};
      const NormalEquations at = accumulate(data, random.T_curr_prev, levels, kernel);
      const double h = 1e-6;
      for (int k = 0; k < 6; ++k) {
        Vector6d xi = Vector6d::Zero();
        xi[k] = h;
        const NormalEquations plus = accumulate(data, SE3::exp(xi) * random.T_curr_prev, levels, kernel);
        const NormalEquations minus = accumulate(data, SE3::exp(-xi) * random.T_curr_prev, levels, kernel);
        EXPECT_NEAR((plus.cost - minus.cost) / (2 * h), at.gradient[k], 1e-5 * at.gradient.norm()) << k;
        if (kind != RobustKernel::Kind::none) continue;  // other Hessians are cut to be semi-definite
        const Vector6d column = (plus.gradient - minus.gradient) / (2 * h);
        EXPECT_LT((column - at.hessian.col(k)).norm(), 0.1 * at.hessian.col(k).norm()) << k;
      }
    }
  }
}

TEST(FlowDepthSolver, ExactDepthIsMotionOnly) {
  const RandomProblem random = make_random_problem(4, {.n_points = 203, .outlier_share = 0.2});
  FlowDepthData data(random.problem);
  const SolverResult ours =
      minimize_flow_depth(data, random.start.T_curr_prev, {.sigma_flow_u_px = 0.7, .sigma_flow_v_px = 0.7},
                          {RobustKernel::Kind::huber, 1.345}, {});
  const MotionEstimate motion =
      MotionOnly({.sigma_px = 0.7, .huber = 1.345}).estimate(random.problem, random.start);
  EXPECT_LT(pose_difference(ours.T_curr_prev, motion.T_curr_prev), 1e-9);
  EXPECT_NEAR(ours.at_optimum.cost, motion.cost, 1e-9 * motion.cost);
}

/// Mean of xi^T C^-1 xi / 6 over random problems, 1 for an honest covariance.
double mean_nees(const RandomProblemOptions& problem, const JointFlowDepthOptions& options, int n) {
  double sum = 0;
  for (int seed = 1; seed <= n; ++seed) {
    const RandomProblem random = make_random_problem(static_cast<unsigned>(seed), problem);
    const MotionEstimate estimate = JointFlowDepth(options).estimate(random.problem, random.start);
    EXPECT_EQ(estimate.status, Status::ok) << seed;
    const Vector6d xi = (estimate.T_curr_prev * random.T_curr_prev.inverse()).log();
    sum += xi.dot(estimate.covariance.ldlt().solve(xi));
  }
  return sum / n / 6;
}

// 6 n degrees of freedom: standard error sqrt(2 / (6 n)) = 1.3 % for 2000 problems; 95 % within 2.5 %.
TEST(JointFlowDepth, CovarianceIsHonest) {
  const RandomProblemOptions problem{.n_points = 120, .delta_d_px = 0.2};
  EXPECT_NEAR(mean_nees(problem, with("none", 0.3, 0.3, 0.2), 2000), 1, 0.026);
}

TEST(JointFlowDepth, CovarianceOfTheDefaultKernelIsHonest) {
  const RandomProblemOptions problem{.n_points = 200, .delta_d_px = 0.2};
  EXPECT_NEAR(mean_nees(problem, with("geman_mcclure_gnc", 0.3, 0.3, 0.2), 300), 1, 0.12);
}

TEST(JointFlowDepth, ReadmitsWhatTheStartLeftOut) {
  RandomProblem random = make_random_problem(5, {.n_points = 300, .delta_d_px = 0.2});
  for (size_t i = 0; i < 300; i += 2) random.start.inliers[i] = 0;
  for (const char* robust : {"none", "huber", "geman_mcclure_gnc"}) {
    const MotionEstimate estimate =
        JointFlowDepth(with(robust, 0.3, 0.3, 0.2)).estimate(random.problem, random.start);
    ASSERT_EQ(estimate.status, Status::ok);
    EXPECT_GT(std::count(estimate.inliers.begin(), estimate.inliers.end(), 1), 295) << robust;
  }
}

TEST(JointFlowDepth, WrongFlowsDoNotBendTheMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    RandomProblemOptions options{.n_points = 600, .delta_d_px = 0.1};
    options.outlier_share = 0.5;
    const RandomProblem random = make_random_problem(seed, options);
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    const MotionEstimate estimate = JointFlowDepth({}).estimate(random.problem, start.start);
    ASSERT_EQ(estimate.status, Status::ok);
    EXPECT_LT(pose_difference(estimate.T_curr_prev, random.T_curr_prev), 0.03) << seed;
  }
}

TEST(JointFlowDepth, BadMeasurementsAreAStatus) {
  RandomProblem random = make_random_problem(6, {.n_points = 6});
  for (const double bad : {std::nan(""), 0.0, -1.0, HUGE_VAL}) {
    random.problem.points.depth.assign(6, bad);
    EXPECT_EQ(JointFlowDepth({}).estimate(random.problem, random.start).status,
              bad == HUGE_VAL ? Status::at_infinity : Status::too_few_points)
        << bad;
  }
  random = make_random_problem(7, {.n_points = 40});
  random.problem.points.flow_u[3] = NAN;
  const MotionEstimate estimate = JointFlowDepth({}).estimate(random.problem, random.start);
  EXPECT_EQ(estimate.status, Status::ok);
  EXPECT_EQ(estimate.inliers[3], 0);
}

TEST(JointFlowDepth, SameBitsTwice) {
  const RandomProblem random =
      make_random_problem(8, {.n_points = 2500, .outlier_share = 0.3, .delta_d_px = 0.2});
  const MotionEstimate a = JointFlowDepth({}).estimate(random.problem, random.start);
  const MotionEstimate b = JointFlowDepth({}).estimate(random.problem, random.start);
  EXPECT_EQ(a.T_curr_prev.matrix(), b.T_curr_prev.matrix());
  EXPECT_EQ(a.covariance, b.covariance);
}

TEST(RobustOption, GraduatedMotionOnlyAndJointFlowResistOutliers) {
  const RandomProblem random = make_random_problem(9, {.n_points = 800, .outlier_share = 0.5});
  StartingPoint start = robust_start(random.problem, std::nullopt, {}).start;
  MotionOnlyOptions motion;
  JointFlowOptions joint;
  motion.robust = joint.robust = "geman_mcclure_gnc";
  const MotionEstimate a = MotionOnly(motion).estimate(random.problem, start);
  const MotionEstimate b = JointFlow(joint).estimate(random.problem, start);
  ASSERT_EQ(a.status, Status::ok);
  EXPECT_LT(pose_difference(a.T_curr_prev, random.T_curr_prev), 0.03);
  EXPECT_LT(pose_difference(a.T_curr_prev, b.T_curr_prev), 1e-12);
  EXPECT_THROW(make_estimator("motion_only", Json{{"robust", "tukey"}}), Error);
}

TEST(LocalPlanes, TakeNoiseFromPlanesAndLeaveEdgesAlone) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  const double kappa = 0.2 / 380;
  Correspondences points;
  std::vector<double> exact;
  for (int v = 0; v < 60; v += 3) {
    for (int u = 0; u < 60; u += 3) {
      exact.push_back(0.05 + 1e-4 * u - 5e-5 * v + (u >= 30 ? 0.03 : 0));
      points.push_back(u, v, 1 / (exact.back() + kappa * normal(engine)), 0, 0);
    }
  }
  const std::vector<LocalPlane> planes = fit_local_planes(points, kappa, 6);
  double measured = 0, fitted = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    const double u = points.u[i];
    if (u > 23 && u < 36) {  // the neighbourhood holds the step
      EXPECT_EQ(planes[i].variance_share, 1);
      EXPECT_EQ(planes[i].inverse_depth, 1 / points.depth[i]);
    } else if (planes[i].variance_share < 1) {
      measured += std::pow(1 / points.depth[i] - exact[i], 2);
      fitted += std::pow(planes[i].inverse_depth - exact[i], 2);
    }
  }
  EXPECT_GT(measured, 0);
  EXPECT_LT(fitted, 0.15 * measured);
}

}  // namespace
}  // namespace sextant
