// Tests of the CRLB against derivations that share none of its formulas: the Fisher information of all
// unknowns by numeric differentiation of the measurement function, and the errors of a least-squares
// estimator.

#include "sextant/metrics/crlb.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "sextant/geometry/object_motion.h"
#include "sextant/geometry/testing.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {
namespace {

const PinholeCamera camera{700, 720, 600, 180};

struct Scene {
  SE3 X;
  Correspondences exact;
};

Scene make_scene(unsigned seed, int n, double near_m = 4, double far_m = 20) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Scene scene{SE3(so3_exp({0.01, 0.05, -0.02}), Eigen::Vector3d(0.3, -0.1, -1.2)), {}};
  for (int i = 0; i < n; ++i) {
    const double u = 600 + 550 * uniform(random);
    const double v = 180 + 160 * uniform(random);
    const double z = near_m + (far_m - near_m) * (1 + uniform(random)) / 2;
    const Eigen::Vector3d p = scene.X * camera.backproject(u, v, z);
    const Eigen::Vector2d uv = camera.project(p);
    scene.exact.push_back(u, v, z, uv.x() - u, uv.y() - v, p.z());
  }
  return scene;
}

/// Maps all unknowns [xi; z_1..z_n] to all measurements divided by their standard deviations [flow u, flow v,
/// z (, z')]_i.
class Measurement {
 public:
  Measurement(const Scene& scene, const MeasurementNoise& noise, bool both_depths)
      : scene_(scene), noise_(noise), rows_(both_depths ? 4 : 3) {}

  int n() const { return static_cast<int>(scene_.exact.size()); }
  Eigen::VectorXd truth() const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(6 + n());
    for (int i = 0; i < n(); ++i) x[6 + i] = scene_.exact.depth[i];
    return x;
  }
  Eigen::VectorXd operator()(const Eigen::VectorXd& x) const {
    const SE3 X = SE3::exp(x.head<6>()) * scene_.X;
    Eigen::VectorXd y(rows_ * n());
    for (int i = 0; i < n(); ++i) {
      const double u = scene_.exact.u[i], v = scene_.exact.v[i];
      const Eigen::Vector3d p = X * camera.backproject(u, v, x[6 + i]);
      const Eigen::Vector2d uv = camera.project(p);
      y[rows_ * i] = (uv.x() - u) / noise_.flow_x_px;
      y[rows_ * i + 1] = (uv.y() - v) / noise_.flow_y_px;
      y[rows_ * i + 2] = x[6 + i] / noise_.depth_sigma_m(scene_.exact.depth[i]);
      if (rows_ == 4) y[rows_ * i + 3] = p.z() / noise_.depth_sigma_m(scene_.exact.depth_curr[i]);
    }
    return y;
  }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& x) const {
    Eigen::MatrixXd J(rows_ * n(), 6 + n());
    for (int k = 0; k < x.size(); ++k) {
      Eigen::VectorXd above = x, below = x;
      above[k] += 1e-6;
      below[k] -= 1e-6;
      J.col(k) = ((*this)(above) - (*this)(below)) / (above[k] - below[k]);
    }
    return J;
  }

 private:
  const Scene& scene_;
  MeasurementNoise noise_;
  int rows_;
};

const MeasurementNoise declared{0.5, 0.2, 0.2 / 350};

/// Expects equal covariances to a relative precision that does not depend on the units of the entries.
void expect_equal_covariance(const Matrix6d& a, const Matrix6d& b, double tolerance) {
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(a(i, k), b(i, k), tolerance * std::sqrt(b(i, i) * b(k, k)));
  }
}

TEST(MotionBound, IsTheMotionBlockOfTheInverseInformationOfAllUnknowns) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Scene scene = make_scene(seed, 25);
    const auto bound = motion_bound(camera, scene.exact, scene.X, declared);
    ASSERT_TRUE(bound && bound->both_depths);
    for (const bool both : {false, true}) {
      const Measurement measure(scene, declared, both);
      const Eigen::MatrixXd J = measure.jacobian(measure.truth());
      const Matrix6d expected = (J.transpose() * J).inverse().topLeftCorner<6, 6>();
      expect_equal_covariance(both ? *bound->both_depths : bound->previous_depth, expected, 1e-5);
    }
  }
}

// The errors of each channel are correlated by the distance of their pixels; the three channels are
// independent.
TEST(MotionBound, UsesTheFullCovarianceOfCorrelatedErrors) {
  const Scene scene = make_scene(6, 40);
  MeasurementNoise correlated = declared;
  correlated.independent_gaussian = false;
  correlated.correlation.parts = {{60, 0.4}, {300, 0.4}};
  const auto bound = motion_bound(camera, scene.exact, scene.X, correlated);
  ASSERT_TRUE(bound);
  EXPECT_FALSE(bound->both_depths);
  MeasurementNoise rounded = correlated;
  rounded.gaussian = false;
  EXPECT_FALSE(motion_bound(camera, scene.exact, scene.X, rounded));
  const Measurement measure(scene, declared, false);
  const Eigen::MatrixXd J = measure.jacobian(measure.truth());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(J.rows(), J.rows());
  for (int i = 0; i < measure.n(); ++i) {
    for (int k = 0; k < measure.n(); ++k) {
      const double distance =
          std::hypot(scene.exact.u[i] - scene.exact.u[k], scene.exact.v[i] - scene.exact.v[k]);
      for (int channel = 0; channel < 3; ++channel)
        covariance(3 * i + channel, 3 * k + channel) = correlated.correlation.at(distance);
    }
  }
  const Matrix6d expected = (J.transpose() * covariance.inverse() * J).inverse().topLeftCorner<6, 6>();
  expect_equal_covariance(bound->previous_depth, expected, 1e-5);
  const auto independent = motion_bound(camera, scene.exact, scene.X, declared);
  correlated.correlation.parts = {{1e-3, 0.8}};  // far shorter than the distance between points
  expect_equal_covariance(motion_bound(camera, scene.exact, scene.X, correlated)->previous_depth,
                          independent->previous_depth, 1e-9);

  correlated.flow_outlier_share = 0.1;
  EXPECT_FALSE(motion_bound(camera, scene.exact, scene.X, correlated));
  EXPECT_FALSE(motion_bound(camera, make_scene(7, 601).exact, scene.X, correlated));  // cubic cost
}

TEST(MotionBound, ExactDepthLeavesTheFlow) {
  const Scene scene = make_scene(4, 30);
  const MeasurementNoise flow_only{0.5, 0.2};
  const auto bound = motion_bound(camera, scene.exact, scene.X, flow_only);
  ASSERT_TRUE(bound);
  EXPECT_FALSE(bound->both_depths);
  Matrix6d information = Matrix6d::Zero();
  for (size_t i = 0; i < scene.exact.size(); ++i) {
    const Eigen::Vector3d p =
        scene.X * camera.backproject(scene.exact.u[i], scene.exact.v[i], scene.exact.depth[i]);
    const auto J = numeric_jacobian(
        [&](const Vector6d& xi) { return Eigen::Vector2d(camera.project(SE3::exp(xi) * p)); },
        Vector6d(Vector6d::Zero()));
    information += J.row(0).transpose() * J.row(0) / 0.25 + J.row(1).transpose() * J.row(1) / 0.04;
  }
  expect_equal_covariance(bound->previous_depth, information.inverse(), 1e-6);
}

TEST(MotionBound, MoreMeasurementsNeverIncreaseTheBound) {
  const Scene scene = make_scene(5, 40);
  const auto all = motion_bound(camera, scene.exact, scene.X, declared);
  std::vector<unsigned char> keep(40, 1);
  keep[7] = 0;
  const auto fewer = motion_bound(camera, scene.exact.subset(keep), scene.X, declared);
  const auto smallest = [](const Matrix6d& m) {
    return Eigen::SelfAdjointEigenSolver<Matrix6d>(m).eigenvalues()[0];
  };
  EXPECT_GT(smallest(fewer->previous_depth - all->previous_depth), -1e-15);
  EXPECT_GT(smallest(all->previous_depth - *all->both_depths), -1e-15);
  EXPECT_LT(rms_error(*all->both_depths).Et_m, rms_error(all->previous_depth).Et_m);
}

TEST(MotionBound, IsAbsentWithoutAFiniteBound) {
  const Scene scene = make_scene(6, 30);
  EXPECT_FALSE(motion_bound(camera, scene.exact, scene.X, {0, 0, 1e-3}));    // exact flow
  EXPECT_FALSE(motion_bound(camera, scene.exact, scene.X, {0.5, 0, 1e-3}));  // exact flow in one axis
  EXPECT_FALSE(motion_bound(camera, scene.exact, scene.X, {0.5, 0.2, 1e-3, 0.1, {}, false}));
  EXPECT_FALSE(motion_bound(camera, {}, scene.X, declared));
  EXPECT_FALSE(motion_bound(camera, make_scene(7, 2).exact, scene.X, declared));
  Correspondences line;  // all points on one line in space: the rotation about it is free
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(-2, 0.5, 6) + 0.3 * i * Eigen::Vector3d(1, 0.1, 0.2);
    const Eigen::Vector2d uv = camera.project(p);
    line.push_back(uv.x(), uv.y(), p.z(), 0, 0);
  }
  EXPECT_FALSE(motion_bound(camera, line, scene.X, declared));
}

/// Gauss-Newton over the motion and all depths, started at the true values: the maximum-likelihood estimate.
struct Fit {
  SE3 X;
  Matrix6d covariance;
};
Fit fit(const Measurement& measure, const Scene& scene, const Eigen::VectorXd& measured) {
  Eigen::VectorXd x = measure.truth();
  Matrix6d covariance;
  for (int iteration = 0; iteration < 4; ++iteration) {
    const Eigen::MatrixXd J = measure.jacobian(x);
    const Eigen::MatrixXd inverse = (J.transpose() * J).inverse();
    x += inverse * (J.transpose() * (measured - measure(x)));
    covariance = inverse.topLeftCorner<6, 6>();
  }
  return {SE3::exp(x.head<6>()) * scene.X, covariance};
}

/// Ratio of the RMS of the observed errors to the RMS of the bound, for E_t and E_R.
class Ratio {
 public:
  void add(const PoseChangeError& error) {
    Et_ += error.Et_m * error.Et_m;
    ER_ += error.ER_deg * error.ER_deg;
    ++n_;
  }
  void expect_near_one(const Matrix6d& bound, double tolerance) const {
    EXPECT_NEAR(std::sqrt(Et_ / n_) / rms_error(bound).Et_m, 1, tolerance);
    EXPECT_NEAR(std::sqrt(ER_ / n_) / rms_error(bound).ER_deg, 1, tolerance);
  }

 private:
  double Et_ = 0, ER_ = 0;
  int n_ = 0;
};

TEST(MotionBound, IsReachedByMaximumLikelihoodInEveryFrame) {
  constexpr int n_trials = 800;
  constexpr double tolerance = 0.06;  // standard error of the RMS over 800 trials: 2.5 % at most
  const MeasurementNoise small{0.05, 0.02, 0.02 / 350};  // small errors: first order is exact enough
  const Scene background = make_scene(8, 24);
  Scene object = make_scene(9, 20, 6, 9);
  object.X = SE3(so3_exp({0, -0.06, 0}), Eigen::Vector3d(0.2, 0, 0.4));
  const SE3 L(so3_exp({0.1, 0.7, 0}), Eigen::Vector3d(1, 1, 8));  // T_camera_object
  const SE3 H = background.X.inverse() * object.X;
  const Matrix6d C0 = motion_bound(camera, background.exact, background.X, small)->previous_depth;
  const Matrix6d C = *motion_bound(camera, object.exact, object.X, small)->both_depths;

  std::mt19937_64 random(10);
  std::normal_distribution<double> normal;
  const auto estimate = [&](const Scene& scene, bool both) {
    const Measurement measure(scene, small, both);
    Eigen::VectorXd measured = measure(measure.truth());
    for (double& value : measured) value += normal(random);
    return fit(measure, scene, measured);
  };
  Ratio ego, camera_frame, body_frame;
  double sum_nees = 0;
  for (int trial = 0; trial < n_trials; ++trial) {
    const Fit of_background = estimate(background, false);
    const Fit of_object = estimate(object, true);
    ego.add(pose_change_error(of_background.X.inverse(), background.X.inverse()));
    camera_frame.add(pose_change_error(of_object.X, object.X));
    const SE3 H_estimated = of_background.X.inverse() * of_object.X;
    body_frame.add(pose_change_error(body_motion(H_estimated, L), body_motion(H, L)));
    sum_nees += nees(of_object.X, of_object.covariance, object.X).value();
  }
  ego.expect_near_one(C0, tolerance);
  camera_frame.expect_near_one(transported(C, object.X.inverse()), tolerance);
  body_frame.expect_near_one(transported(C + C0, (object.X * L).inverse()), tolerance);
  EXPECT_NEAR(sum_nees / n_trials, nees_dof, 4 * std::sqrt(2.0 * nees_dof / n_trials));
}

TEST(Nees, ByHand) {
  Matrix6d covariance = Matrix6d::Identity();
  covariance(0, 0) = 0.04;  // m^2
  covariance(4, 4) = 1e-4;  // rad^2
  const SE3 truth(so3_exp({0, 0.3, 0}), {1, 2, 3});
  Vector6d error = Vector6d::Zero();
  error[0] = 0.4;  // two standard deviations
  EXPECT_NEAR(nees(SE3::exp(error) * truth, covariance, truth).value(), 4, 1e-9);
  error.setZero();
  error[4] = 0.03;  // three standard deviations
  EXPECT_NEAR(nees(SE3::exp(error) * truth, covariance, truth).value(), 9, 1e-9);
  EXPECT_FALSE(nees(truth, Matrix6d::Zero(), truth));
}

}  // namespace
}  // namespace sextant
