#include "sextant/estimator/joint_flow_depth.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sextant/estimator/ceres_flow_depth.h"
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

}  // namespace
}  // namespace sextant
