#include <gtest/gtest.h>
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <random>

#include "sextant/estimator/solvers/reprojection_solver.h"
#include "sextant/estimator/solvers/testing.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

double translation_error_m(const SE3& a, const SE3& b) { return (a.inverse() * b).translation().norm(); }

TEST(RobustStart, SurvivesHalfOutliers) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const RandomProblem random =
        make_random_problem(seed, {.n_points = 600, .flow_noise_px = 0.2, .outlier_share = 0.5});
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    ASSERT_EQ(start.status, Status::ok);
    const int at_truth = count_inliers(RoughReprojectionData(random.problem), random.T_curr_prev, 1.0, 0);
    EXPECT_GT(start.n_inliers, 0.97 * at_truth) << seed;
    EXPECT_LT(translation_error_m(start.point.T_curr_prev, random.T_curr_prev), 0.1) << seed;
    EXPECT_EQ(std::count(start.point.inliers.begin(), start.point.inliers.end(), 1), start.n_inliers);
    EXPECT_FALSE(start.propagated);
  }
}

TEST(RobustStart, PropagatedMotionWinsWhenItHasMoreInliers) {
  const RandomProblem random = make_random_problem(1, {.n_points = 400, .flow_noise_px = 0.5});
  RobustStartOptions options;
  options.local_refinements = 0;
  const RobustStart start = robust_start(random.problem, random.T_curr_prev, options);
  EXPECT_TRUE(start.propagated);
  EXPECT_LT(translation_error_m(start.point.T_curr_prev, random.T_curr_prev), 1e-12);
  // A wrong propagated motion loses.
  const SE3 wrong(Eigen::Quaterniond::Identity(), Eigen::Vector3d(5, 0, 0));
  EXPECT_FALSE(robust_start(random.problem, wrong, options).propagated);
}

TEST(RobustStart, SameResultEveryTime) {
  const RandomProblem random = make_random_problem(2, {.n_points = 500, .outlier_share = 0.3});
  const RobustStart a = robust_start(random.problem, std::nullopt, {});
  const RobustStart b = robust_start(random.problem, std::nullopt, {});
  EXPECT_EQ(a.point.T_curr_prev.matrix(), b.point.T_curr_prev.matrix());
  EXPECT_EQ(a.point.inliers, b.point.inliers);
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
      robust_start(identical.problem, std::nullopt, {});  // any status is acceptable, but no crash and no NaN
  EXPECT_TRUE(start.point.T_curr_prev.is_finite());
}

}  // namespace

namespace {

struct Sample {
  std::array<Eigen::Vector3d, 3> points;
  std::array<Eigen::Vector3d, 3> rays;
  SE3 motion;
};

Sample make_sample(std::mt19937_64& engine) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Sample sample;
  Vector6d xi;
  for (int k = 0; k < 6; ++k) xi[k] = uniform(engine) * (k < 3 ? 2 : 0.3);
  sample.motion = SE3::exp(xi);
  for (size_t k = 0; k < 3; ++k) {
    const double z = 6 + 5 * uniform(engine);
    sample.points[k] = {z * uniform(engine), 0.4 * z * uniform(engine), z};
    sample.rays[k] = (sample.motion * sample.points[k]).normalized();
  }
  return sample;
}

double nearest(const P3PSolutions& solutions, const SE3& motion) {
  double least = INFINITY;
  for (const SE3& solution : solutions) least = std::min(least, pose_difference(solution, motion));
  return least;
}

TEST(P3P, OneOfTheSolutionsIsTheMotion) {
  std::mt19937_64 engine(1);
  int exact = 0;
  constexpr int n = 10000;
  for (int k = 0; k < n; ++k) {
    const Sample sample = make_sample(engine);
    const double error = nearest({sample.points, sample.rays}, sample.motion);
    EXPECT_LT(error, 1e-2) << k;  // two nearly coincident solutions are ill-conditioned
    exact += error < 1e-8 ? 1 : 0;
  }
  EXPECT_GT(exact, 0.995 * n);
}

TEST(P3P, FindsWhatOpenCvFinds) {
  std::mt19937_64 engine(2);
  int more = 0;
  for (int k = 0; k < 1000; ++k) {
    const Sample sample = make_sample(engine);
    std::array<cv::Point3d, 3> points;
    std::array<cv::Point2d, 3> pixels;
    for (size_t i = 0; i < 3; ++i) {
      points[i] = {sample.points[i].x(), sample.points[i].y(), sample.points[i].z()};
      pixels[i] = {sample.rays[i].x() / sample.rays[i].z(), sample.rays[i].y() / sample.rays[i].z()};
    }
    std::vector<cv::Vec3d> rotations, translations;
    cv::solveP3P(points, pixels, cv::Matx33d::eye(), cv::noArray(), rotations, translations,
                 cv::SOLVEPNP_AP3P);
    const P3PSolutions ours(sample.points, sample.rays);
    for (size_t i = 0; i < rotations.size(); ++i) {
      const SE3 theirs(so3_exp({rotations[i][0], rotations[i][1], rotations[i][2]}),
                       {translations[i][0], translations[i][1], translations[i][2]});
      // OpenCV also returns the real parts of complex solutions, which map no point onto its ray.
      bool solves = true;
      for (size_t j = 0; j < 3; ++j) {
        solves = solves && ((theirs * sample.points[j]).normalized() - sample.rays[j]).norm() < 1e-9;
      }
      if (solves) {
        EXPECT_LT(nearest(ours, theirs), 1e-4) << k;
      }
    }
    more += ours.size() > rotations.size() ? 1 : 0;
  }
  EXPECT_LT(more, 500);
}

TEST(P3P, DegenerateTrianglesGiveFiniteSolutionsOrNone) {
  const Eigen::Vector3d a(0, 0, 5), b(1, 0, 5), c(2, 0, 5);
  const auto ray = [](const Eigen::Vector3d& p) { return p.normalized(); };
  for (const auto& points : {std::array{a, a, a}, std::array{a, a, b}, std::array{a, b, c},
                             std::array{a, b, a}, std::array{a, b, Eigen::Vector3d(NAN, 0, 1)},
                             std::array{a, b, Eigen::Vector3d(0, INFINITY, INFINITY)}}) {
    for (const SE3& motion : P3PSolutions(points, {ray(points[0]), ray(points[1]), ray(points[2])})) {
      EXPECT_TRUE(motion.is_finite());
    }
  }
}

TEST(QuarticRoots, OfProductsOfFactors) {
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int k = 0; k < 1000; ++k) {
    std::array<double, 4> truth;
    for (double& x : truth) x = uniform(engine);
    const auto [x1, x2, x3, x4] = truth;
    const std::array<double, 4> roots =
        quartic_roots({-(x1 + x2 + x3 + x4), x1 * x2 + x1 * x3 + x1 * x4 + x2 * x3 + x2 * x4 + x3 * x4,
                       -(x1 * x2 * x3 + x1 * x2 * x4 + x1 * x3 * x4 + x2 * x3 * x4), x1 * x2 * x3 * x4});
    for (const double x : truth) {
      double least = INFINITY;
      for (const double root : roots) least = std::min(least, std::abs(root - x));
      EXPECT_LT(least, 1e-4) << k;
    }
  }
  // A biquadratic: (x^2 - 1)(x^2 - 4).
  std::array<double, 4> roots = quartic_roots({0, -5, 0, 4});
  std::sort(roots.begin(), roots.end());
  const std::array<double, 4> truth = {-2, -1, 1, 2};
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(roots[k], truth[k], 1e-12);
}

}  // namespace

}  // namespace sextant
