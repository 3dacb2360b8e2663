// Tests of every registered estimator.

#include "sextant/estimator/registry.h"
#include "sextant/base/testing.h"
#include "sextant/estimator/solvers/testing.h"

namespace sextant {
namespace {

class EveryEstimator : public ::testing::TestWithParam<EstimatorEntry> {};

TEST_P(EveryEstimator, FindsTheMotion) {
  const auto random = make_random_problem(1, {.n_points = 300, .flow_noise_px = 0.1});
  const MotionEstimate estimate = GetParam().make(Json::object())->estimate(random.problem, random.start);
  ASSERT_EQ(estimate.status, Status::ok);
  EXPECT_LT((estimate.T_curr_prev.inverse() * random.T_curr_prev).translation().norm(), 0.02);
  EXPECT_EQ(estimate.inliers.size(), 300U);
  EXPECT_EQ(estimate.refined_flow_u.size(), 300U);
  EXPECT_EQ(estimate.refined_flow_v.size(), 300U);
  EXPECT_GT(estimate.covariance.diagonal().minCoeff(), 0);
}

TEST_P(EveryEstimator, NoPointsIsAStatus) {
  EXPECT_EQ(GetParam().make(Json::object())->estimate({}, {}).status, Status::too_few_points);
}

TEST_P(EveryEstimator, OptionsAreStrictAndDescribed) {
  EXPECT_THROW(GetParam().make(Json{{"no_such_option", 1}}), Error);
  EXPECT_FALSE(GetParam().description.empty());
  for (const OptionHelp& option : GetParam().options()) EXPECT_FALSE(option.meaning.empty()) << option.key;
  const auto estimator = GetParam().make(Json::object());
  EXPECT_EQ(GetParam().make(estimator->options())->options(), estimator->options());
}

INSTANTIATE_TEST_SUITE_P(, EveryEstimator, ::testing::ValuesIn(estimators().begin(), estimators().end()),
                         [](const auto& test) { return test.param.name; });

TEST(MakeEstimator, ReferencesRefuseOptionsThatTheyIgnore) {
  for (const std::string name : {"motion_only_ceres", "joint_flow_ceres", "joint_flow_depth_ceres"}) {
    EXPECT_EQ(make_estimator(name)->options().at("covariance"), "independent") << name;
    expect_error([&] { make_estimator(name, {{"covariance", "correlated"}}); }, "expected independent");
    expect_error([&] { make_estimator(name, {{"solver", {{"step_tolerance", 1e-3}}}}); }, "Ceres' own");
  }
}

TEST(MakeEstimator, UnknownNameSuggestsTheNearest) {
  expect_error([] { make_estimator("join_flow"); }, "did you mean 'joint_flow'?");
}

}  // namespace
}  // namespace sextant
