#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <random>

#include "sextant/estimator/estimators/joint_flow.h"
#include "sextant/estimator/flow_depth/joint_flow_depth.h"
#include "sextant/estimator/flow_depth/noise_levels.h"
#include "sextant/estimator/reference/ceres_reference.h"
#include "sextant/estimator/reference/testing.h"
#include "sextant/estimator/registry.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

struct Case {
  const char* name;
  RandomProblemOptions problem;
  JointFlowDepthOptions options;
};

JointFlowDepthOptions with(Robust robust, double sigma_u = 0, double sigma_v = 0, double delta_d = 0) {
  JointFlowDepthOptions options;
  options.robust = robust;
  options.sigma_flow_u_px = sigma_u;
  options.sigma_flow_v_px = sigma_v;
  options.delta_d_px = delta_d;
  options.plane_radius_px = 0;
  options.solver.step_tolerance = 1e-9;
  options.covariance = CovarianceOf::independent;  // the optimum of the cost alone
  return options;
}

class JointFlowDepthAgainstCeres : public ::testing::TestWithParam<Case> {};

TEST_P(JointFlowDepthAgainstCeres, SameCostPoseAndFlows) {
  expect_same_optimum<JointFlowDepth, JointFlowDepthCeres>(GetParam().problem, GetParam().options, 6, 1e-8);
}

INSTANTIATE_TEST_SUITE_P(
    , JointFlowDepthAgainstCeres,
    ::testing::Values(
        Case{"Plain", {.n_points = 300, .delta_d_px = 0.2}, with(Robust::none, 0.3, 0.3, 0.2)},
        Case{"Anisotropic", {.n_points = 300, .delta_d_px = 0.2}, with(Robust::none, 0.5, 0.2, 0.2)},
        Case{"BothDepths",
             {.n_points = 300, .delta_d_px = 0.2, .depth_curr = true},
             with(Robust::none, 0.3, 0.3, 0.2)},
        Case{"Huber",
             {.n_points = 300, .outlier_share = 0.2, .delta_d_px = 0.2},
             with(Robust::huber, 0.3, 0.3, 0.2)},
        Case{"HuberBothDepths",
             {.n_points = 500, .outlier_share = 0.2, .delta_d_px = 0.2, .depth_curr = true},
             with(Robust::huber, 0.3, 0.3, 0.1)},
        Case{"Graduated",
             {.n_points = 500, .outlier_share = 0.3, .delta_d_px = 0.2},
             with(Robust::geman_mcclure_gnc, 0.3, 0.3, 0.2)},
        Case{"Estimated",
             {.n_points = 500, .outlier_share = 0.3, .delta_d_px = 0.2, .depth_curr = true},
             with(Robust::geman_mcclure_gnc)},
        Case{"Twenty", {.n_points = 20, .delta_d_px = 0.1}, with(Robust::huber, 0.3, 0.3, 0.1)},
        Case{"FlowAlmostExact",
             {.n_points = 300, .flow_noise_px = 0.02, .delta_d_px = 0.2},
             with(Robust::none, 0.02, 0.02, 0.2)}),
    [](const auto& test) { return test.param.name; });

TEST(FlowDepthSolver, GradientAndHessianAgainstFiniteDifferences) {
  const RandomProblem random =
      make_random_problem(3, {.n_points = 61, .delta_d_px = 0.2, .depth_curr = true});
  FlowDepthData data(random.problem);
  NoiseLevels levels{
      .sigma_flow_u_px = 0.5, .sigma_flow_v_px = 0.3, .delta_d_px = 0.2, .delta_d_curr_px = 0.3};
  for (const DepthErrors noise : {DepthErrors::depth, DepthErrors::disparity}) {
    levels.depth_noise = noise;
    for (const auto kind :
         {RobustKernel::Kind::none, RobustKernel::Kind::huber, RobustKernel::Kind::geman_mcclure}) {
      const RobustKernel kernel{kind, 2.0};
      const NormalEquations at = accumulate(data, random.T_curr_prev, levels, kernel);
      const NormalEquations newton = accumulate(data, random.T_curr_prev, levels, kernel, Curvature::newton);
      const double h = 1e-6;
      Matrix6d columns;
      for (int k = 0; k < 6; ++k) {
        Vector6d xi = Vector6d::Zero();
        xi[k] = h;
        const NormalEquations plus = accumulate(data, SE3::exp(xi) * random.T_curr_prev, levels, kernel);
        const NormalEquations minus = accumulate(data, SE3::exp(-xi) * random.T_curr_prev, levels, kernel);
        EXPECT_NEAR((plus.cost - minus.cost) / (2 * h), at.gradient[k], 1e-5 * at.gradient.norm()) << k;
        const Vector6d column = columns.col(k) = (plus.gradient - minus.gradient) / (2 * h);
        // the other Hessians are truncated to be semi-definite
        if (kind != RobustKernel::Kind::none) continue;
        EXPECT_LT((column - at.hessian.col(k)).norm(), 0.1 * at.hessian.col(k).norm()) << k;
      }
      // Rotations do not commute, which adds an antisymmetric part to the derivatives of the gradient.
      const Matrix6d exact = 0.5 * (columns + columns.transpose());
      // The effect of a rotation on a translation is neglected: it vanishes at the optimum.
      EXPECT_LT((exact - newton.hessian).norm(), 1e-5 * exact.norm());
    }
  }
}

TEST(FlowDepthSolver, FloatIsTheSameToItsPrecision) {
  const RandomProblem random =
      make_random_problem(3, {.n_points = 997, .outlier_share = 0.2, .delta_d_px = 0.2, .depth_curr = true});
  FlowDepthData data(random.problem);
  RoughFlowDepthData rough(data);
  const NoiseLevels levels{
      .sigma_flow_u_px = 0.5, .sigma_flow_v_px = 0.3, .delta_d_px = 0.2, .delta_d_curr_px = 0.3};
  for (const Curvature curvature : {Curvature::rough, Curvature::gauss_newton, Curvature::newton}) {
    for (const auto kind :
         {RobustKernel::Kind::none, RobustKernel::Kind::huber, RobustKernel::Kind::geman_mcclure}) {
      data.reset_depths();
      rough.reset_depths();
      const NormalEquations a = accumulate(data, random.T_curr_prev, levels, {kind, 2.0}, curvature);
      const NormalEquations b = accumulate(rough, random.T_curr_prev, levels, {kind, 2.0}, curvature);
      EXPECT_NEAR(a.cost, b.cost, 1e-3 * a.cost);
      EXPECT_LT((a.gradient - b.gradient).norm(), 1e-3 * a.gradient.norm());
      EXPECT_LT((a.hessian - b.hessian).norm(), 1e-3 * a.hessian.norm());
    }
  }
  evaluate_points(data, random.T_curr_prev, levels);
  evaluate_points(rough, random.T_curr_prev, levels);
  for (size_t i = 0; i < data.size(); ++i) {
    EXPECT_NEAR(rough.q(i), data.q(i), 1e-2 + 1e-3 * data.q(i)) << i;
    EXPECT_NEAR(rough.inverse_depth(i), data.inverse_depth(i), 1e-4 * data.inverse_depth(i)) << i;
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

TEST(FlowDepthSolver, SinglePrecisionEndsNextToTheOptimum) {
  // 3000 points: a sample of them precedes the descent on all.
  const RandomProblem random =
      make_random_problem(9, {.n_points = 3000, .delta_d_px = 0.2, .depth_curr = true});
  const NoiseLevels levels = {
      .sigma_flow_u_px = 0.3, .sigma_flow_v_px = 0.3, .delta_d_px = 0.2, .delta_d_curr_px = 0.2};
  const RobustKernel kernel = {RobustKernel::Kind::geman_mcclure, 4.0};
  FlowDepthData data(random.problem);
  const SE3& start = random.start.T_curr_prev;
  const SE3 close = minimize_roughly(data, start, levels, kernel, {});
  const SolverResult next = minimize_flow_depth(data, close, levels, kernel, {.max_iterations = 1});
  data.reset_depths();
  const SE3 optimum = minimize_flow_depth(data, start, levels, kernel, {}).T_curr_prev;
  EXPECT_GT(pose_difference(start, optimum), 1e-3);
  EXPECT_LT(pose_difference(close, optimum), 1e-4);
  EXPECT_LT(pose_difference(next.T_curr_prev, optimum), JointFlowDepthOptions{}.solver.step_tolerance);
}

/// Returns the mean of xi^T C^-1 xi / 6 over random problems, which is 1 for a consistent covariance.
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
TEST(JointFlowDepth, CovarianceIsConsistent) {
  const RandomProblemOptions problem{.n_points = 120, .delta_d_px = 0.2};
  JointFlowDepthOptions options = with(Robust::none, 0.3, 0.3, 0.2);
  EXPECT_NEAR(mean_nees(problem, options, 2000), 1, 0.026);
  // Unless independence is declared, errors are partly attributed to correlation: standard deviations are 1.4
  // times too large.
  options.covariance = CovarianceOf::correlated;
  EXPECT_NEAR(mean_nees(problem, options, 500), 0.48, 0.05);
  // More points reduce the effect of independent errors but not that of correlated ones.
  EXPECT_NEAR(mean_nees({.n_points = 1500, .delta_d_px = 0.2}, options, 100), 0.14, 0.05);
}

TEST(JointFlowDepth, CovarianceOfTheDefaultKernelIsConsistent) {
  const RandomProblemOptions problem{.n_points = 200, .delta_d_px = 0.2};
  EXPECT_NEAR(mean_nees(problem, with(Robust::geman_mcclure_gnc, 0.3, 0.3, 0.2), 300), 1, 0.12);
}

// Without the correction of variance_factor() for few observations the means are 1.20 and 1.46.
TEST(JointFlowDepth, CovarianceOfTheDefaultKernelIsConsistentForFewPoints) {
  const JointFlowDepthOptions options = with(Robust::geman_mcclure_gnc, 0.3, 0.3, 0.2);
  EXPECT_NEAR(mean_nees({.n_points = 40, .delta_d_px = 0.2}, options, 600), 1, 0.12);
  EXPECT_NEAR(mean_nees({.n_points = 20, .delta_d_px = 0.2}, options, 600), 1, 0.28);
}

// A distant, flat car: 120 points within +-`relief_m` of 30 m, depths with 1.8 m standard deviation, observed
// from another car.
RandomProblem make_far_car(unsigned seed, double relief_m, double turn_rad, double flow_scale = 1) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  RandomProblem out;
  const StereoCamera camera{{700, 700, 600, 180}, 350};
  out.problem = {camera, {}, MeasurementNoise{0.3 * flow_scale, 0.2 * flow_scale, 1.8 / (30 * 30)}};
  const SE3 centre(Eigen::Quaterniond::Identity(), {1, 0, 30});
  out.T_curr_prev = centre * SE3(so3_exp({0, turn_rad, 0}), {0.02, 0, -0.05}) * centre.inverse();
  for (int i = 0; i < 120; ++i) {
    const double u = camera.left.cx + 25 + 20 * uniform(engine);
    const double v = camera.left.cy + 15 * uniform(engine);
    const double z = 30 + relief_m * uniform(engine);
    const Eigen::Vector2d to = camera.left.project(out.T_curr_prev * camera.left.backproject(u, v, z));
    out.problem.points.push_back(u, v, z + 1.8 * z * z / 900 * normal(engine),
                                 to.x() - u + 0.3 * flow_scale * normal(engine),
                                 to.y() - v + 0.2 * flow_scale * normal(engine));
  }
  out.start = {out.T_curr_prev, std::vector<unsigned char>(120, 1)};
  return out;
}

struct FarCars {
  double rms_m = 0;  ///< RMS of E_t
  double worst_m = 0;
  double nees = 0;  ///< mean NEES over 6
};

FarCars estimate_cars(const Estimator& estimator, const auto& make_car) {
  constexpr int n = 300;
  FarCars out;
  for (unsigned seed = 1; seed <= n; ++seed) {
    const RandomProblem car = make_car(seed);
    const MotionEstimate estimate = estimator.estimate(car.problem, car.start);
    EXPECT_EQ(estimate.status, Status::ok) << seed;
    const double error = (estimate.T_curr_prev.inverse() * car.T_curr_prev).translation().norm();
    const Vector6d xi = (estimate.T_curr_prev * car.T_curr_prev.inverse()).log();
    out.rms_m += error * error / n;
    out.worst_m = std::max(out.worst_m, error);
    out.nees += xi.dot(estimate.covariance.ldlt().solve(xi)) / n / 6;
  }
  out.rms_m = std::sqrt(out.rms_m);
  return out;
}

FarCars estimate_far_cars(const Estimator& estimator, double relief_m, double turn_rad) {
  return estimate_cars(estimator, [&](unsigned seed) { return make_far_car(seed, relief_m, turn_rad); });
}

// Without the prior of errors_in_variables.h some estimates are wrong by metres.
TEST(JointFlowDepth, FarFlatBodiesAreNoWorseThanWithJointFlow) {
  for (const double relief_m : {0.2, 0.8, 1.5}) {
    const FarCars ours = estimate_far_cars(JointFlowDepth({}), relief_m, 0);
    const FarCars joint = estimate_far_cars(JointFlow({}), relief_m, 0);
    EXPECT_LT(ours.rms_m, 1.02 * joint.rms_m) << relief_m;
    EXPECT_LT(ours.worst_m, 5 * joint.rms_m) << relief_m;
  }
}

// The covariance includes the bias that the data cannot exclude, which is large if the relief is not
// significant. This object does not rotate and has no bias, so the covariance is conservative. Standard error
// of 300 trials: 3.3 %.
TEST(JointFlowDepth, CovarianceOfFarFlatBodiesIsConservative) {
  for (const double relief_m : {0.2, 0.8, 1.5}) {
    const double nees = estimate_far_cars(JointFlowDepth({}), relief_m, 0).nees;
    EXPECT_GT(nees, 0.6) << relief_m;
    EXPECT_LT(nees, 1.1) << relief_m;
  }
  EXPECT_LT(estimate_far_cars(JointFlowDepth({}), 2.5, 0.05).nees, 1.25);
}

// Without the prior, the motion at which points are first chosen may be so far off that wrong flows pass,
// with depths that make the body look deep and the estimate certain.
TEST(JointFlowDepth, WrongFlowsOnAFarBodyDoNotMakeItCertain) {
  const auto make_car = [](unsigned seed) {
    RandomProblem car = make_far_car(seed, 1.5, 0, 3);
    car.problem.noise.reset();
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> wrong(-50, 50);
    for (size_t i = 0; i < 120; i += 8) {
      car.problem.points.flow_u[i] += wrong(engine);
      car.problem.points.flow_v[i] += wrong(engine);
    }
    const RobustStart start = robust_start(car.problem, std::nullopt, {});
    EXPECT_EQ(start.status, Status::ok) << seed;
    car.start = start.point;
    return car;
  };
  EXPECT_LT(estimate_cars(JointFlowDepth({}), make_car).nees, 6.6 / 6);
}

TEST(JointFlowDepth, RotationOfAFarBodyIsNotSuppressedByThePrior) {
  const double turn = 3 * 3.14159265 / 180;
  const FarCars ours = estimate_far_cars(JointFlowDepth({}), 2.5, turn);
  const FarCars joint = estimate_far_cars(JointFlow({}), 2.5, turn);
  EXPECT_LT(ours.rms_m, 0.8 * joint.rms_m);
}

// Exact flow determines the motion up to its length, whatever the noise of the depths.
TEST(JointFlowDepth, ExactFlowDeterminesTheMotionOfAFarBody) {
  for (const double delta_d_px : {0.1, 0.2, 0.4}) {
    constexpr int n = 40;
    double sum_m2 = 0;
    for (unsigned seed = 1; seed <= n; ++seed) {
      const RandomProblem body = make_random_problem(seed, {.n_points = 400,
                                                            .flow_noise_px = 0,
                                                            .near_m = 16,
                                                            .far_m = 19,
                                                            .spread = 0.1,
                                                            .delta_d_px = delta_d_px});
      const RobustStart start = robust_start(body.problem, std::nullopt, {});
      const MotionEstimate estimate = JointFlowDepth({}).estimate(body.problem, start.point);
      ASSERT_EQ(estimate.status, Status::ok) << seed;
      sum_m2 += (estimate.T_curr_prev.inverse() * body.T_curr_prev).translation().squaredNorm();
    }
    EXPECT_LT(std::sqrt(sum_m2 / n), 0.004 * delta_d_px) << delta_d_px;
  }
}

TEST(JointFlowDepth, SameOptimumAsCeresWithAPrior) {
  JointFlowDepthOptions exact;
  exact.solver.step_tolerance = 1e-9;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const RandomProblem car = make_far_car(seed, 0.8, 0.01);
    FlowDepthData data(car.problem);
    ASSERT_TRUE(decide(car.problem, car.start, {}, data).prior.holds());
    const MotionEstimate ours = JointFlowDepth(exact).estimate(car.problem, car.start);
    const MotionEstimate reference = JointFlowDepthCeres({}).estimate(car.problem, car.start);
    ASSERT_EQ(ours.status, Status::ok) << seed;
    ASSERT_EQ(reference.status, Status::ok) << seed;
    EXPECT_LT(pose_difference(ours.T_curr_prev, reference.T_curr_prev), 1e-8) << seed;
    EXPECT_NEAR(ours.cost, reference.cost, 1e-8 * reference.cost) << seed;
  }
}

TEST(JointFlowDepth, ReadmitsInliersMissedByTheStart) {
  RandomProblem random = make_random_problem(5, {.n_points = 300, .delta_d_px = 0.2});
  for (size_t i = 0; i < 300; i += 2) random.start.inliers[i] = 0;
  for (const Robust robust : {Robust::none, Robust::huber, Robust::geman_mcclure_gnc}) {
    const MotionEstimate estimate =
        JointFlowDepth(with(robust, 0.3, 0.3, 0.2)).estimate(random.problem, random.start);
    ASSERT_EQ(estimate.status, Status::ok);
    EXPECT_GT(std::count(estimate.inliers.begin(), estimate.inliers.end(), 1), 295) << to_string(robust);
  }
}

TEST(JointFlowDepth, OutliersDoNotBiasTheMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    RandomProblemOptions options{.n_points = 600, .delta_d_px = 0.1};
    options.outlier_share = 0.5;
    const RandomProblem random = make_random_problem(seed, options);
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    const MotionEstimate estimate = JointFlowDepth({}).estimate(random.problem, start.point);
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

// A rough surface at 20 m, to which no plane fits: current depths also contain information on its distance.
TEST(JointFlowDepth, CurrentDepthsCountOffPlanes) {
  JointFlowDepthOptions both = with(Robust::geman_mcclure_gnc, 0.3, 0.3, 0.2);
  both.plane_radius_px = 6;
  JointFlowDepthOptions previous = both;
  previous.use_depth_curr = false;
  double square_both = 0, square_previous = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const RandomProblem random = make_random_problem(
        seed,
        {.n_points = 400, .near_m = 19, .far_m = 21, .spread = 0.05, .delta_d_px = 0.2, .depth_curr = true});
    const auto squared_error = [&](const JointFlowDepthOptions& options) {
      const MotionEstimate estimate = JointFlowDepth(options).estimate(random.problem, random.start);
      EXPECT_EQ(estimate.status, Status::ok) << seed;
      const Eigen::Vector3d centre(0, 0, 20);
      return std::pow((estimate.T_curr_prev * centre - random.T_curr_prev * centre).z(), 2);
    };
    square_both += squared_error(both);
    square_previous += squared_error(previous);
  }
  EXPECT_LT(std::sqrt(square_both / square_previous), 0.9);
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
  StartingPoint start = robust_start(random.problem, std::nullopt, {}).point;
  MotionOnlyOptions motion;
  JointFlowOptions joint;
  motion.robust = joint.robust = Robust::geman_mcclure_gnc;
  const MotionEstimate a = MotionOnly(motion).estimate(random.problem, start);
  const MotionEstimate b = JointFlow(joint).estimate(random.problem, start);
  ASSERT_EQ(a.status, Status::ok);
  EXPECT_LT(pose_difference(a.T_curr_prev, random.T_curr_prev), 0.03);
  EXPECT_LT(pose_difference(a.T_curr_prev, b.T_curr_prev), 1e-12);
  EXPECT_THROW(make_estimator("motion_only", Json{{"robust", "tukey"}}), Error);
}

TEST(LocalPlanes, FindSlopesAndTheReliefOfEdges) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  const double kappa = 0.2 / 380;
  Correspondences points;
  for (int v = 0; v < 60; v += 3) {
    for (int u = 0; u < 60; u += 3) {
      const double exact = 0.05 + 1e-4 * u - 5e-5 * v + (u >= 30 ? 0.03 : 0);
      points.push_back(u, v, 1 / (exact + kappa * normal(engine)), 0, 0);
    }
  }
  const LocalPlanes planes(points, kappa, 6);
  int n_accepted = 0;
  double sum_u = 0, sum_v = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const bool beside_step = points.u[i] > 23 && points.u[i] < 32;  // the nine cells of 4 px reach the step
    if (beside_step) {
      EXPECT_TRUE(!planes[i].fitted || planes[i].relief > 10 * kappa * kappa);
    }
    if (!planes[i].fitted || planes[i].relief > 0) continue;
    ++n_accepted;
    sum_u += planes[i].slope_u;
    sum_v += planes[i].slope_v;
  }
  EXPECT_GT(n_accepted, 250);
  EXPECT_NEAR(sum_u / n_accepted, 1e-4, 2e-5);
  EXPECT_NEAR(sum_v / n_accepted, -5e-5, 2e-5);
}

}  // namespace

}  // namespace sextant
