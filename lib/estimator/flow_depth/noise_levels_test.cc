#include <gtest/gtest.h>
#include <cmath>
#include <random>

#include "sextant/estimator/flow_depth/noise_levels.h"
#include "sextant/estimator/solvers/testing.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

std::vector<float> absolute_normal(size_t n, double sigma, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, sigma);
  std::vector<float> values(n);
  for (float& value : values) value = static_cast<float>(std::abs(normal(engine)));
  return values;
}

TEST(RobustScale, OfAGaussianAtEveryMagnitude) {
  for (const double sigma : {1e-6, 0.3, 2e4}) {
    EXPECT_NEAR(robust_scale(absolute_normal(20000, sigma, 1), {}), sigma, 0.03 * sigma);
  }
  EXPECT_EQ(robust_scale({}, {}), 0);
  EXPECT_EQ(robust_scale({0, 0, 0}, {}), 0);
}

TEST(RobustScale, GrossErrorsDoNotCountIfItBeginsWithGoodValues) {
  std::vector<float> values = absolute_normal(1000, 0.3, 2);
  const std::vector<float> good(values.begin(), values.begin() + 200);
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<float> gross(0, 20);
  for (int k = 0; k < 3000; ++k) values.push_back(gross(engine));
  EXPECT_GT(robust_scale(values, {}), 2);  // scale of the majority, which are outliers
  EXPECT_NEAR(robust_scale(values, good), 0.3, 0.1);
}

// Samples of 1500 points, a quarter of which are correct.
TEST(NoiseLevels, AreEstimatedFromTheFewCorrectPoints) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const RandomProblem random = make_random_problem(seed, {.n_points = 3000,
                                                            .flow_noise_px = 0.3,
                                                            .outlier_share = 0.75,
                                                            .delta_d_px = 0.2,
                                                            .depth_curr = true});
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    ASSERT_EQ(start.status, Status::ok);
    LevelSample sample(RoughFlowDepthData(FlowDepthData(random.problem)), start.point);
    const NoiseLevels first =
        estimate_noise_levels(sample, LevelsOf::inliers, start.point.T_curr_prev, {0, 0, 0});
    EXPECT_NEAR(first.sigma_flow_u_px, 0.3, 0.1) << seed;
    const NoiseLevels levels = estimate_noise_levels(sample, LevelsOf::all, random.T_curr_prev, {0, 0, 0});
    EXPECT_NEAR(levels.sigma_flow_u_px, 0.3, 0.1) << seed;
    EXPECT_NEAR(levels.delta_d_px, 0.2, 0.06) << seed;
    EXPECT_NEAR(estimate_delta_d_curr(sample, random.T_curr_prev, levels), 0.2, 0.1) << seed;
  }
}

TEST(NoiseLevels, DeclaredLevelsAreKept) {
  const RandomProblem random = make_random_problem(1, {.n_points = 300, .delta_d_px = 0.2});
  LevelSample sample(RoughFlowDepthData(FlowDepthData(random.problem)), random.start);
  const NoiseLevels levels = estimate_noise_levels(sample, LevelsOf::all, random.T_curr_prev, {0.7, 0, 0.4});
  EXPECT_EQ(levels.sigma_flow_u_px, 0.7);
  EXPECT_EQ(levels.delta_d_px, 0.4);
  EXPECT_NEAR(levels.sigma_flow_v_px, 0.3, 0.06);
}

}  // namespace

}  // namespace sextant
