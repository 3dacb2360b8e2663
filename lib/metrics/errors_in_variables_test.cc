// The errors-in-variables effect (docs/method.md): the rotation of an object about its own centre is observed
// through the change of flow with depth over the object. An estimator that treats measured depths as exact
// underestimates this rotation by the factor lambda = s^2 / (s^2 + sigma^2), s = spread of the true depths,
// sigma = their errors. Its estimate then scatters less than that of any unbiased estimator.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "sextant/estimator/registry.h"
#include "sextant/metrics/crlb.h"

namespace sextant {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180;
constexpr int n_points = 300;
constexpr double distance_m = 20;
constexpr double relief_m = 1;         // depths are uniform within +- relief_m
constexpr double depth_sigma_m = 0.5;  // at `distance_m`
const StereoCamera stereo{{700, 700, 600, 180}, 350};
const MeasurementNoise noise{0.3, 0.3, depth_sigma_m / (distance_m * distance_m)};

/// An object that turns about the vertical axis through its centre and comes 0.5 m nearer.
struct Turning {
  SE3 X;
  Correspondences exact;
};

Turning turning(double turn_rad, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const SE3 centre(Eigen::Quaterniond::Identity(), {0, 0, distance_m});
  const SE3 turn(so3_exp({0, turn_rad, 0}), {0, 0, -0.5});
  Turning out{centre * turn * centre.inverse(), {}};
  for (int i = 0; i < n_points; ++i) {
    const double u = stereo.left.cx + 40 * uniform(random);
    const double v = stereo.left.cy + 25 * uniform(random);
    const double z = distance_m + relief_m * uniform(random);
    const Eigen::Vector2d uv = stereo.left.project(out.X * stereo.left.backproject(u, v, z));
    out.exact.push_back(u, v, z, uv.x() - u, uv.y() - v);
  }
  return out;
}

struct Motion {
  SE3 X;
  Matrix6d covariance;
};

/// Returns d project(exp(xi) p) / d xi at xi = 0.
Eigen::Matrix<double, 2, 6> motion_jacobian(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 2, 6> J;
  J << stereo.left.project_jacobian(p), -stereo.left.project_jacobian(p) * skew(p);
  return J;
}

/// The structured estimate: every depth is an unknown, with residual and Jacobian at the refined depth.
/// Gauss-Newton.
class Structured {
 public:
  Structured(const Problem& problem, const SE3& start) : problem_(problem), X(start) {
    for (int iteration = 0; iteration < 20; ++iteration) {
      linearise();
      X = SE3::exp(H_.ldlt().solve(gradient_)) * X;
    }
    linearise();
  }
  /// Returns (H - B)^-1 H (H - B)^-1, see docs/method.md.
  Matrix6d covariance() const {
    const Matrix6d N_inverse = (H_ - B_).inverse();
    return N_inverse * H_ * N_inverse;
  }

 private:
  void linearise() {
    gradient_.setZero();
    H_.setZero();
    B_.setZero();
    for (size_t i = 0; i < problem_.points.size(); ++i) add_point(i);
  }
  void add_point(size_t i) {
    const Correspondences& points = problem_.points;
    const Eigen::Vector3d ray = X.rotation() * stereo.left.ray(points.u[i], points.v[i]);
    const Eigen::Vector2d target(points.u[i] + points.flow_u[i], points.v[i] + points.flow_v[i]);
    const double depth_information = std::pow(noise.depth_sigma_m(points.depth[i]), -2);
    const double flow_information = std::pow(noise.flow_x_px, -2);
    double z = points.depth[i];
    Eigen::Vector3d p;
    Eigen::Vector2d r, j;
    double information = 0;
    for (int step = 0; step < 6; ++step) {
      p = z * ray + X.translation();
      r = target - stereo.left.project(p);
      j = stereo.left.project_jacobian(p) * ray;
      information = depth_information + flow_information * j.squaredNorm();
      z += (depth_information * (points.depth[i] - z) + flow_information * j.dot(r)) / information;
    }
    const auto J = motion_jacobian(p);
    const auto above = motion_jacobian(p + 1e-4 * ray);
    const Eigen::Matrix<double, 2, 6> slope = (above - J) / 1e-4;
    const Eigen::Matrix2d W =
        (Eigen::Matrix2d::Identity() / flow_information + j * j.transpose() / depth_information).inverse();
    gradient_ += flow_information * J.transpose() * r;
    H_ += J.transpose() * W * J;
    B_ += slope.transpose() * W * slope / information;
  }

  const Problem& problem_;
  Vector6d gradient_;
  Matrix6d H_, B_;

 public:
  SE3 X;
};

using FitFunction = std::function<Motion(const Problem&, const SE3& start)>;

Motion motion_only(const Problem& problem, const SE3& start) {
  static const auto estimator = make_estimator("motion_only", {{"huber", 1e6}});
  const std::vector<unsigned char> all(problem.points.size(), 1);
  const MotionEstimate found = estimator->estimate(problem, {start, all});
  return {found.T_curr_prev, found.covariance};
}

Motion structured(const Problem& problem, const SE3& start) {
  const Structured fit(problem, start);
  return {fit.X, fit.covariance()};
}

struct Estimated {
  double mean_turn_rad = 0;
  double rms_error_rad = 0;
  double bound_rad = 0;      ///< RMS of the bound on the rotation
  double predicted_rad = 0;  ///< RMS of the standard deviation that the estimate predicts
};

Estimated estimate(const FitFunction& fit, double turn_rad, int n_trials) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  double sum = 0, squares = 0, bound = 0, predicted = 0;
  for (int trial = 0; trial < n_trials; ++trial) {
    const Turning object = turning(turn_rad, random);
    Problem problem{stereo, object.exact, noise};
    Correspondences& points = problem.points;
    for (size_t i = 0; i < points.size(); ++i) {
      points.depth[i] += noise.depth_sigma_m(points.depth[i]) * normal(random);
      points.flow_u[i] += noise.flow_x_px * normal(random);
      points.flow_v[i] += noise.flow_y_px * normal(random);
    }
    const Motion found = fit(problem, object.X);
    const double turn = so3_log(found.X.rotation()).y();
    sum += turn;
    squares += (turn - turn_rad) * (turn - turn_rad);
    bound += motion_bound(stereo.left, object.exact, object.X, noise)->previous_depth(4, 4);
    predicted += found.covariance(4, 4);
  }
  const auto rms = [&](double total) { return std::sqrt(total / n_trials); };
  return {sum / n_trials, rms(squares), rms(bound), rms(predicted)};
}

/// Returns d mean estimate / d truth, at zero rotation.
double slope(const FitFunction& fit, int n_trials) {
  const double turn = 2 * rad_per_deg;
  return (estimate(fit, turn, n_trials).mean_turn_rad - estimate(fit, -turn, n_trials).mean_turn_rad) /
         (2 * turn);
}

constexpr double spread2 = relief_m * relief_m / 3;
constexpr double lambda = spread2 / (spread2 + depth_sigma_m * depth_sigma_m);

TEST(ErrorsInVariables, MeasuredDepthsTakenForTrueShrinkTheTurn) {
  const double shrinkage = slope(motion_only, 100);
  const Estimated standing = estimate(motion_only, 0, 200);
  fmt::print("lambda {:.3f}; motion_only: slope {:.3f}, RMS of no turn {:.4f} deg, bound {:.4f} deg\n",
             lambda, shrinkage, standing.rms_error_rad / rad_per_deg, standing.bound_rad / rad_per_deg);
  EXPECT_NEAR(shrinkage, lambda, 0.03);
  EXPECT_LT(standing.rms_error_rad, 0.85 * standing.bound_rad);
}

TEST(ErrorsInVariables, DepthsAsUnknownsRemoveItAtAPrice) {
  const double shrinkage = slope(structured, 100);
  const Estimated standing = estimate(structured, 0, 200);
  fmt::print("structured: slope {:.3f}, RMS of no turn {:.4f} deg, predicted {:.4f} deg, bound {:.4f} deg\n",
             shrinkage, standing.rms_error_rad / rad_per_deg, standing.predicted_rad / rad_per_deg,
             standing.bound_rad / rad_per_deg);
  EXPECT_NEAR(shrinkage, 1, 0.03);
  EXPECT_GT(standing.rms_error_rad, 1.1 * standing.bound_rad);
  EXPECT_NEAR(standing.rms_error_rad / standing.predicted_rad, 1, 0.15);
}

}  // namespace
}  // namespace sextant
