#include "sextant/estimator/estimators/joint_flow.h"

#include <limits>

#include "sextant/estimator/flow_depth/correlated_covariance.h"
#include "sextant/estimator/flow_depth/graduation.h"
#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {
namespace {

/// Common part of motion_only and joint_flow: solves with a kernel and fills in everything except the refined
/// flow. robust = none removes the threshold.
MotionEstimate estimate_with_kernel(const Problem& problem, const StartingPoint& start, HuberKernel kernel,
                                    Robust robust, const SolverOptions& options) {
  if (robust == Robust::geman_mcclure_gnc) return estimate_graduated(problem, start, options);
  if (robust == Robust::none) kernel.threshold = std::numeric_limits<double>::infinity();
  MotionEstimate estimate = begin_estimate(problem, start.inliers);
  if (estimate.status != Status::ok) return estimate;
  const ReprojectionData data(problem, estimate.inliers);
  const SolverResult solution = minimize_reprojection(data, start.T_curr_prev, kernel, options);
  if (take_solution(solution, estimate)) conclude(problem, solution.at_optimum.hessian, 1, estimate);
  return estimate;
}

}  // namespace

void MotionOnlyOptions::check() const {
  check_option(sigma_px > 0, "sigma_px", sigma_px, "> 0");
  check_option(huber > 0, "huber", huber, "> 0");
}

MotionEstimate MotionOnly::estimate(const Problem& problem, const StartingPoint& start) const {
  const HuberKernel kernel{options_.sigma_px, options_.huber};
  MotionEstimate estimate = estimate_with_kernel(problem, start, kernel, options_.robust, options_.solver);
  if (options_.covariance == CovarianceOf::correlated && estimate.status == Status::ok) {
    const bool huber = options_.robust == Robust::huber;
    correlate(problem, {options_.sigma_px, huber ? options_.huber : std::numeric_limits<double>::infinity()},
              estimate);
  }
  return estimate;
}

void JointFlowOptions::check() const {
  check_option(sigma_projection_px > 0, "sigma_projection_px", sigma_projection_px, "> 0");
  check_option(sigma_flow_px > 0, "sigma_flow_px", sigma_flow_px, "> 0");
  check_option(huber_projection > 0, "huber_projection", huber_projection, "> 0");
  check_option(huber_flow > 0, "huber_flow", huber_flow, "> 0");
}

MotionEstimate JointFlow::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate =
      estimate_with_kernel(problem, start, options_.effective_kernel(), options_.robust, options_.solver);
  if (estimate.status != Status::ok) return estimate;
  if (options_.covariance == CovarianceOf::correlated)
    correlate(problem, options_.effective_kernel(), estimate);
  const HuberKernel projection = options_.projection_kernel();
  const HuberKernel flow = options_.flow_kernel();
  const Correspondences& points = problem.points;
  const PinholeCamera& camera = problem.camera.left;
  for (size_t i = 0; i < points.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    const Eigen::Vector3d m = camera.backproject(points.u[i], points.v[i], points.depth[i]);
    const Eigen::Vector2d target(points.u[i] + points.flow_u[i], points.v[i] + points.flow_v[i]);
    const Eigen::Vector2d r = target - camera.project(estimate.T_curr_prev * m);
    const Eigen::Vector2d correction = split_residual(r, projection, flow);
    estimate.refined_flow_u[i] -= correction.x();
    estimate.refined_flow_v[i] -= correction.y();
  }
  return estimate;
}

}  // namespace sextant
