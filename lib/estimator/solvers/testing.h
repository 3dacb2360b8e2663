#pragma once

// Random one-body problems for tests and benchmarks: a motion, visible points, flow and depth noise,
// outliers. A pure function of the arguments.

#include <algorithm>
#include <cmath>
#include <random>

#include "sextant/estimator/solvers/estimator.h"
#include "sextant/measurement/problem.h"

namespace sextant {

struct RandomProblemOptions {
  int n_points = 500;
  double flow_noise_px = 0.3;
  double outlier_share = 0.0;  ///< share of flows with additional uniform errors of up to 20 px
  double near_m = 5.0;
  double far_m = 40.0;
  double spread = 1.0;        ///< share of the image that the points cover; small = near-degenerate
  double delta_d_px = 0;      ///< disparity noise of the depths
  bool depth_curr = false;    ///< adds depths of the current frame
  double start_error = 0.02;  ///< largest error of the initial twist: m, and ten times the one in rad
};

struct RandomProblem {
  Problem problem;
  SE3 T_curr_prev;
  StartingPoint start;  ///< near the true motion, with all points
};

/// Returns the largest absolute component of the twist between two motions (m, rad).
inline double pose_difference(const SE3& a, const SE3& b) {
  return (a * b.inverse()).log().cwiseAbs().maxCoeff();
}

/// Returns the largest absolute difference between components of the refined flows (px).
inline double flow_difference(const MotionEstimate& a, const MotionEstimate& b) {
  double worst = 0;
  for (size_t i = 0; i < a.refined_flow_u.size(); ++i) {
    worst = std::max({worst, std::abs(a.refined_flow_u[i] - b.refined_flow_u[i]),
                      std::abs(a.refined_flow_v[i] - b.refined_flow_v[i])});
  }
  return worst;
}

inline RandomProblem make_random_problem(unsigned seed, const RandomProblemOptions& options) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(engine() >> 11U) * 0x1p-53);
  };
  std::normal_distribution<double> normal;
  RandomProblem out;
  StereoCamera& camera = out.problem.camera;
  camera = {{720, 718, 610, 180}, 380};
  Vector6d xi;
  xi << uniform(-0.2, 0.2), uniform(-0.1, 0.1), uniform(-1.5, -0.3), uniform(-0.01, 0.01),
      uniform(-0.03, 0.03), uniform(-0.01, 0.01);
  out.T_curr_prev = SE3::exp(xi);
  for (int i = 0; i < options.n_points; ++i) {
    const double u = 610 + options.spread * uniform(-600, 600);
    const double v = 180 + options.spread * uniform(-170, 190);
    const double z = uniform(options.near_m, options.far_m);
    const Eigen::Vector3d p = out.T_curr_prev * camera.left.backproject(u, v, z);
    const Eigen::Vector2d uv = camera.left.project(p);
    double du = uv.x() - u + options.flow_noise_px * normal(engine);
    double dv = uv.y() - v + options.flow_noise_px * normal(engine);
    if (uniform(0, 1) < options.outlier_share) {
      du += uniform(-20, 20);
      dv += uniform(-20, 20);
    }
    const auto noisy = [&](double depth_m) {
      if (options.delta_d_px == 0) return depth_m;
      return depth_m + camera.depth_sigma_m(depth_m, options.delta_d_px) * normal(engine);
    };
    const double measured_m = noisy(z);
    out.problem.points.push_back(u, v, measured_m, du, dv, options.depth_curr ? noisy(p.z()) : NAN);
  }
  Vector6d error;
  for (int k = 0; k < 6; ++k) error[k] = options.start_error * uniform(-1, 1) * (k < 3 ? 1 : 0.1);
  out.start.T_curr_prev = SE3::exp(error) * out.T_curr_prev;
  out.start.inliers.assign(out.problem.points.size(), 1);
  return out;
}

}  // namespace sextant
