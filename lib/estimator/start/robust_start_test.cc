#include "sextant/estimator/start/robust_start.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "sextant/estimator/solvers/reprojection_solver.h"
#include "sextant/estimator/solvers/testing.h"

namespace sextant {
namespace {

double translation_error_m(const SE3& a, const SE3& b) { return (a.inverse() * b).translation().norm(); }

TEST(RobustStart, SurvivesHalfOutliers) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const RandomProblem random =
        make_random_problem(seed, {.n_points = 600, .flow_noise_px = 0.2, .outlier_share = 0.5});
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    ASSERT_EQ(start.status, Status::ok);
    const int at_truth = count_inliers(ReprojectionData(random.problem), random.T_curr_prev, 1.0, 0);
    EXPECT_GT(start.n_inliers, 0.97 * at_truth) << seed;
    EXPECT_LT(translation_error_m(start.start.T_curr_prev, random.T_curr_prev), 0.1) << seed;
    EXPECT_EQ(std::count(start.start.inliers.begin(), start.start.inliers.end(), 1), start.n_inliers);
    EXPECT_FALSE(start.propagated);
  }
}

TEST(RobustStart, PropagatedMotionWinsWhenItHasMoreInliers) {
  const RandomProblem random = make_random_problem(1, {.n_points = 400, .flow_noise_px = 0.5});
  RobustStartOptions options;
  options.local_refinements = 0;
  const RobustStart start = robust_start(random.problem, random.T_curr_prev, options);
  EXPECT_TRUE(start.propagated);
  EXPECT_LT(translation_error_m(start.start.T_curr_prev, random.T_curr_prev), 1e-12);
  // A wrong one loses.
  const SE3 wrong(Eigen::Quaterniond::Identity(), Eigen::Vector3d(5, 0, 0));
  EXPECT_FALSE(robust_start(random.problem, wrong, options).propagated);
}

TEST(RobustStart, SameResultEveryTime) {
  const RandomProblem random = make_random_problem(2, {.n_points = 500, .outlier_share = 0.3});
  const RobustStart a = robust_start(random.problem, std::nullopt, {});
  const RobustStart b = robust_start(random.problem, std::nullopt, {});
  EXPECT_EQ(a.start.T_curr_prev.matrix(), b.start.T_curr_prev.matrix());
  EXPECT_EQ(a.start.inliers, b.start.inliers);
}

TEST(RobustStart, AgreesWithOpenCvRansac) {
  const RandomProblem random =
      make_random_problem(3, {.n_points = 500, .flow_noise_px = 0.2, .outlier_share = 0.3});
  const Correspondences& p = random.problem.points;
  const PinholeCamera& camera = random.problem.camera.left;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (size_t i = 0; i < p.size(); ++i) {
    const Eigen::Vector3d m = camera.backproject(p.u[i], p.v[i], p.depth[i]);
    points.emplace_back(m.x(), m.y(), m.z());
    pixels.emplace_back(p.u[i] + p.flow_u[i], p.v[i] + p.flow_v[i]);
  }
  cv::Mat rotation, translation, inliers;
  const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::solvePnPRansac(points, pixels, k, cv::noArray(), rotation, translation, false, 500, 1.0F, 0.999,
                     inliers, cv::SOLVEPNP_AP3P);
  const RobustStart start = robust_start(random.problem, std::nullopt, {});
  EXPECT_GE(start.n_inliers, inliers.rows - 5);
}

TEST(RobustStart, DegenerateProblemsGetAStatus) {
  for (const int n : {0, 1, 3}) {
    const RandomProblem random = make_random_problem(4, {.n_points = n});
    EXPECT_EQ(robust_start(random.problem, std::nullopt, {}).status, Status::too_few_points) << n;
  }
  RandomProblem identical = make_random_problem(5, {.n_points = 1});
  const Correspondences one = identical.problem.points;
  for (int k = 0; k < 20; ++k) {
    identical.problem.points.push_back(one.u[0], one.v[0], one.depth[0], one.flow_u[0], one.flow_v[0]);
  }
  const RobustStart start =
      robust_start(identical.problem, std::nullopt, {});  // whatever it says: no crash, no NaN
  EXPECT_TRUE(start.start.T_curr_prev.is_finite());
}

}  // namespace
}  // namespace sextant
