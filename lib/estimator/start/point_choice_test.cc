
#include <gtest/gtest.h>

#include <numeric>

#include "sextant/estimator/estimators/joint_flow.h"
#include "sextant/estimator/solvers/testing.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

size_t count(const StartingPoint& start) {
  return std::accumulate(start.inliers.begin(), start.inliers.end(), size_t{0});
}

StartingPoint start_of(const Problem& problem, double threshold_px) {
  RobustStartOptions options;
  options.inlier_threshold_px = threshold_px;
  const RobustStart start = robust_start(problem, std::nullopt, options);
  EXPECT_EQ(start.status, Status::ok);
  return start.point;
}

/// Returns the RMS translation error (m) over random problems, refined on the chosen points.
double rms_error_m(const RandomProblemOptions& problem, double threshold_px, RefineOn refine_on) {
  double sum = 0;
  constexpr unsigned n = 40;
  for (unsigned seed = 1; seed <= n; ++seed) {
    const RandomProblem random = make_random_problem(seed, problem);
    const StartingPoint start =
        choose_points(random.problem, start_of(random.problem, threshold_px), refine_on);
    const MotionEstimate estimate = MotionOnly({}).estimate(random.problem, start);
    EXPECT_EQ(estimate.status, Status::ok);
    sum += (estimate.T_curr_prev.inverse() * random.T_curr_prev).translation().squaredNorm();
  }
  return std::sqrt(sum / n);
}

/// Noise of the background in the paper's Table II, applied to both axes.
constexpr RandomProblemOptions noisy{.n_points = 1500, .flow_noise_px = 1.34};

TEST(PointChoice, InliersAndAllSelectAsDocumented) {
  RandomProblem random = make_random_problem(1, noisy);
  random.problem.points.depth[7] = NAN;
  random.problem.points.flow_u[8] = INFINITY;
  random.problem.points.depth[9] = -1;
  const StartingPoint start = start_of(random.problem, 1);
  EXPECT_EQ(choose_points(random.problem, start, RefineOn::inliers).inliers, start.inliers);
  const StartingPoint all = choose_points(random.problem, start, RefineOn::all);
  EXPECT_EQ(count(all), 1497U);
  EXPECT_EQ(all.T_curr_prev.matrix(), start.T_curr_prev.matrix());
}

TEST(PointChoice, ReselectsAllPointsOfGaussianNoiseFromAnyThreshold) {
  for (const double threshold_px : {0.3, 1.0, 4.0}) {
    const RandomProblem random = make_random_problem(2, noisy);
    const StartingPoint start = start_of(random.problem, threshold_px);
    if (threshold_px == 0.3) {
      EXPECT_LT(count(start), 0.1 * 1500);
    }
    EXPECT_GT(count(choose_points(random.problem, start, RefineOn::reselected)), 0.99 * 1500) << threshold_px;
  }
}

TEST(PointChoice, NoThresholdInPixelsDecidesTheAccuracy) {
  const double of_all = rms_error_m(noisy, 1, RefineOn::all);
  EXPECT_GT(rms_error_m(noisy, 0.3, RefineOn::inliers), 3 * of_all);
  for (const double threshold_px : {0.3, 1.0, 4.0})
    EXPECT_LT(rms_error_m(noisy, threshold_px, RefineOn::reselected), 1.05 * of_all) << threshold_px;
}

TEST(PointChoice, NoiseFarBelowTheThresholdLosesNoAccuracy) {
  // The first sample of RANSAC already has every point as an inlier.
  for (const double flow_noise_px : {0.01, 0.05, 0.1}) {
    const RandomProblemOptions low{.n_points = 1500, .flow_noise_px = flow_noise_px};
    const double of_all = rms_error_m(low, 1, RefineOn::all);
    for (const double threshold_px : {0.3, 1.0, 4.0})
      EXPECT_LT(rms_error_m(low, threshold_px, RefineOn::reselected), 1.05 * of_all)
          << flow_noise_px << " px, threshold " << threshold_px;
  }
}

TEST(PointChoice, ExactFlowWithNoisyDepthsLosesNoAccuracy) {
  for (const double delta_d_px : {0.1, 0.2, 0.4}) {
    const RandomProblemOptions small_body{.n_points = 400,
                                          .flow_noise_px = 0,
                                          .near_m = 16,
                                          .far_m = 19,
                                          .spread = 0.1,
                                          .delta_d_px = delta_d_px};
    EXPECT_LT(rms_error_m(small_body, 1, RefineOn::reselected),
              1.05 * rms_error_m(small_body, 1, RefineOn::all))
        << delta_d_px;
  }
}

TEST(PointChoice, LeavesWrongFlowsOut) {
  RandomProblemOptions options = noisy;
  options.flow_noise_px = 0.3;
  const double clean = rms_error_m(options, 1, RefineOn::reselected);
  options.outlier_share = 0.4;
  EXPECT_LT(rms_error_m(options, 1, RefineOn::reselected),
            1.6 * clean);  // without the outliers: 1 / sqrt(0.6) = 1.29
  EXPECT_GT(rms_error_m(options, 1, RefineOn::all), 3 * clean);
}

TEST(PointChoice, FindsTheScaleOfEachAxis) {
  RandomProblem random = make_random_problem(3, {.n_points = 2000, .flow_noise_px = 0.2});
  const RandomProblem wider = make_random_problem(3, {.n_points = 2000, .flow_noise_px = 2.0});
  random.problem.points.flow_u = wider.problem.points.flow_u;
  const StartingPoint chosen =
      choose_points(random.problem, start_of(random.problem, 0.5), RefineOn::reselected);
  EXPECT_GT(count(chosen), 0.99 * 2000);
  random.problem.points.flow_v[0] += 4 * 0.2 + 1;  // half a sigma of u, nine sigmas of v
  EXPECT_EQ(choose_points(random.problem, start_of(random.problem, 0.5), RefineOn::reselected).inliers[0], 0);
}

TEST(PointChoice, ExactDataKeepEverything) {
  const RandomProblem random = make_random_problem(4, {.n_points = 300, .flow_noise_px = 0});
  EXPECT_EQ(count(choose_points(random.problem, start_of(random.problem, 1), RefineOn::reselected)), 300U);
}

TEST(PointChoice, TooFewPointsLeaveTheStart) {
  const RandomProblem random = make_random_problem(5, {.n_points = 3});
  const StartingPoint start{random.T_curr_prev, {1, 1, 1}};
  const StartingPoint chosen = choose_points(random.problem, start, RefineOn::reselected);
  EXPECT_EQ(chosen.inliers, start.inliers);
  EXPECT_EQ(chosen.T_curr_prev.matrix(), start.T_curr_prev.matrix());
}

}  // namespace
}  // namespace sextant
