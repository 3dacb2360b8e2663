#include "sextant/estimator/start/p3p.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <random>

#include "sextant/estimator/solvers/testing.h"

namespace sextant {
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
    EXPECT_LT(error, 1e-2) << k;  // two solutions that almost coincide are badly conditioned
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
      // OpenCV also gives the real parts of complex solutions, which bring no point onto its ray.
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

TEST(P3P, DegenerateTrianglesGiveNothingThatIsNotFinite) {
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
  // Without an odd part: (x^2 - 1)(x^2 - 4).
  std::array<double, 4> roots = quartic_roots({0, -5, 0, 4});
  std::sort(roots.begin(), roots.end());
  const std::array<double, 4> truth = {-2, -1, 1, 2};
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(roots[k], truth[k], 1e-12);
}

}  // namespace
}  // namespace sextant
