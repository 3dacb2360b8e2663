// Costs over the motion X and, for joint_flow, the refined flows phihat_i:
//
//   motion_only   sum_i h(p_i + phi_i - project(X m_i))
//   joint_flow    sum_i h1(p_i + phihat_i - project(X m_i)) + h2(phi_i - phihat_i)
//
// where m_i is the point of the pixel p_i in previous camera coordinates. h, h1 and h2 are Huber's kernels
// with standard deviation s and threshold k: |r|^2 / s^2 for |r| <= k s, 2 k |r| / s - k^2 beyond.
//
// For fixed X the minimum of joint_flow's cost over phihat_i is the infimal convolution of h1 and h2 at the
// residual r_i = p_i + phi_i - project(X m_i): the minimum over a + b = r_i of h1(a) + h2(b). It is again a
// Huber kernel, with
//
//   s^2 = s1^2 + s2^2,   k = s min(k1 / s1, k2 / s2),
//
// because the convex conjugates add: h_i*(y) = s_i^2 |y|^2 / 4 on |y| <= 2 k_i / s_i. The motion of
// joint_flow is therefore that of motion_only with this effective kernel, and split_residual() gives the
// refined flow of each point (docs/derivations.md).

#include "sextant/estimator/estimators/joint_flow.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/estimator/flow_depth/correlated_covariance.h"
#include "sextant/estimator/flow_depth/graduation.h"
#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Common part of motion_only and joint_flow: minimises the cost of motion_only with `kernel` and fills in
/// everything except the refined flow. robust = none removes the threshold. begin_estimate() selects the
/// valid measurements among the inliers of the start and checks their geometry; take_solution() copies motion
/// and cost, or reports diverged; conclude() adds the covariance and reports no_parallax if it leaves a
/// direction open (solvers/degeneracy.h). It does not change the motion. minimize_reprojection() is in
/// solvers/reprojection_solver.cc.
MotionEstimate estimate_with_kernel(const Problem& problem, const StartingPoint& start, HuberKernel kernel,
                                    Robust robust, const SolverOptions& options) {
  if (robust == Robust::geman_mcclure_gnc) return estimate_graduated(problem, start, options);
  if (robust == Robust::none) kernel.threshold = infinity;
  MotionEstimate estimate = begin_estimate(problem, start.inliers);
  if (estimate.status != Status::ok) return estimate;
  const ReprojectionData data(problem, estimate.inliers);
  const SolverResult solution = minimize_reprojection(data, start.T_curr_prev, kernel, options);
  if (take_solution(solution, estimate))
    conclude(problem, solution.at_optimum.hessian, /*variance_factor=*/1, estimate);
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
    correlate(problem, {options_.sigma_px, huber ? options_.huber : infinity}, estimate);
  }
  return estimate;
}

void JointFlowOptions::check() const {
  check_option(sigma_projection_px > 0, "sigma_projection_px", sigma_projection_px, "> 0");
  check_option(sigma_flow_px > 0, "sigma_flow_px", sigma_flow_px, "> 0");
  check_option(huber_projection > 0, "huber_projection", huber_projection, "> 0");
  check_option(huber_flow > 0, "huber_flow", huber_flow, "> 0");
}

// With another robust kernel than Huber's the thresholds are infinite, and split_residual() divides by
// variance, as in least squares.
HuberKernel JointFlowOptions::projection_kernel() const {
  return {sigma_projection_px, robust == Robust::huber ? huber_projection : infinity};
}

HuberKernel JointFlowOptions::flow_kernel() const {
  return {sigma_flow_px, robust == Robust::huber ? huber_flow : infinity};
}

HuberKernel JointFlowOptions::effective_kernel() const {
  return infimal_convolution(projection_kernel(), flow_kernel());
}

HuberKernel infimal_convolution(const HuberKernel& projection, const HuberKernel& flow) {
  const double s = std::hypot(projection.sigma_px, flow.sigma_px);
  return {s, s * std::min(projection.threshold / projection.sigma_px, flow.threshold / flow.sigma_px)};
}

Eigen::Vector2d split_residual(const Eigen::Vector2d& r, const HuberKernel& projection,
                               const HuberKernel& flow) {
  const double variance_projection = projection.sigma_px * projection.sigma_px;
  const double variance_flow = flow.sigma_px * flow.sigma_px;
  const double share = variance_flow / (variance_projection + variance_flow);
  const HuberKernel joint = infimal_convolution(projection, flow);
  const double norm = r.norm();
  if (norm <= joint.threshold_px()) return share * r;
  // Beyond the threshold the influence stays at k / s of the kernel with the smaller k / s, its cap. This
  // term takes the rest of the residual, and the other one does not grow any further.
  const double cap_projection = projection.threshold / projection.sigma_px;
  const double cap_flow = flow.threshold / flow.sigma_px;
  const Eigen::Vector2d at_cap = joint.threshold_px() / norm * r;
  if (cap_projection < cap_flow) return share * at_cap;
  if (cap_flow < cap_projection) return r - (1 - share) * at_cap;
  return share * r;
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
