// The errors-in-variables effect (docs/method.md): a turn of an object about its own centre is seen by how
// the flow changes with depth over the object. An estimator that takes the measured depths for true shrinks
// that turn by lambda = s^2 / (s^2 + sigma^2), s = spread of the true depths, sigma = their errors. Its turn
// then scatters less than any unbiased estimator's can.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sextant/estimator/estimator.h"
#include "sextant/metrics/crlb.h"

namespace sextant {
namespace {

constexpr double rad = std::numbers::pi / 180;
constexpr int n_points = 300;
constexpr double distance_m = 20;
constexpr double relief_m = 1;         // depths are uniform within +- this
constexpr double depth_sigma_m = 0.5;  // at `distance_m`
const StereoCamera camera{{700, 700, 600, 180}, 350};
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
    const double u = camera.left.cx + 40 * uniform(random);
    const double v = camera.left.cy + 25 * uniform(random);
    const double z = distance_m + relief_m * uniform(random);
    const Eigen::Vector2d uv = camera.left.project(out.X * camera.left.backproject(u, v, z));
    out.exact.push_back(u, v, z, uv.x() - u, uv.y() - v);
  }
  return out;
}

struct Estimated {
  double mean_turn_rad = 0;
  double rms_error_rad = 0;
  double bound_rad = 0;  ///< RMS of the bound on the turn
};

Estimated estimate(const Estimator& estimator, double turn_rad, int n_trials) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  double sum = 0, squares = 0, bound = 0;
  for (int trial = 0; trial < n_trials; ++trial) {
    const Turning object = turning(turn_rad, random);
    Problem problem{camera, object.exact, noise};
    Correspondences& points = problem.points;
    for (size_t i = 0; i < points.size(); ++i) {
      points.depth[i] += noise.depth_sigma_m(points.depth[i]) * normal(random);
      points.flow_u[i] += noise.flow_x_px * normal(random);
      points.flow_v[i] += noise.flow_y_px * normal(random);
    }
    const MotionEstimate found =
        estimator.estimate(problem, {object.X, std::vector<unsigned char>(points.size(), 1)});
    EXPECT_EQ(found.status, Status::ok);
    const double turn = so3_log(found.T_curr_prev.rotation()).y();
    sum += turn;
    squares += (turn - turn_rad) * (turn - turn_rad);
    bound += motion_bound(camera.left, object.exact, object.X, noise)->previous_depth(4, 4);
  }
  return {sum / n_trials, std::sqrt(squares / n_trials), std::sqrt(bound / n_trials)};
}

/// d mean estimate / d truth, about no turn.
double slope(const Estimator& estimator, int n_trials) {
  const double turn = 2 * rad;
  return (estimate(estimator, turn, n_trials).mean_turn_rad -
          estimate(estimator, -turn, n_trials).mean_turn_rad) /
         (2 * turn);
}

constexpr double spread2 = relief_m * relief_m / 3;
constexpr double lambda = spread2 / (spread2 + depth_sigma_m * depth_sigma_m);

TEST(ErrorsInVariables, MeasuredDepthsTakenForTrueShrinkTheTurn) {
  const auto motion_only = make_estimator("motion_only", {{"huber", 1e6}});
  const double shrinkage = slope(*motion_only, 150);
  const Estimated standing = estimate(*motion_only, 0, 300);
  fmt::print("lambda {:.3f}; motion_only: slope {:.3f}, RMS of no turn {:.4f} deg, bound {:.4f} deg\n",
             lambda, shrinkage, standing.rms_error_rad / rad, standing.bound_rad / rad);
  EXPECT_NEAR(shrinkage, lambda, 0.03);
  EXPECT_LT(standing.rms_error_rad, 0.85 * standing.bound_rad);
}

}  // namespace
}  // namespace sextant
