#include "sextant/estimator/motion_only.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/estimator/graduation.h"
#include "sextant/estimator/noise_levels.h"

namespace sextant {
namespace {

// Six unknowns need three points; a Hessian with a worse condition leaves some direction to chance.
constexpr size_t min_points = 3;
constexpr double max_condition = 1e14;

MotionEstimate estimate_graduated(const Problem& problem, const StartingPoint& start,
                                  const SolverOptions& options) {
  MotionEstimate estimate;
  estimate.inliers.assign(problem.points.size(), 0);
  estimate.refined_flow_u = problem.points.flow_u;
  estimate.refined_flow_v = problem.points.flow_v;
  FlowDepthData data(problem);
  PointEvaluation at;
  evaluate_points(data, start.T_curr_prev, {}, at);
  for (size_t i = 0; i < data.size(); ++i) data.use(i, std::isfinite(at.q[i]), false);
  if (data.n_used() < min_points) {
    estimate.status = Status::too_few_points;
    return estimate;
  }
  const SE3 close = graduate(data, start.T_curr_prev, estimate_reprojection_level(data, start.T_curr_prev));
  const NoiseLevels levels = estimate_reprojection_level(data, close);
  const RobustKernel kernel{RobustKernel::Kind::geman_mcclure, last_graduated_scale};
  const SolverResult solution = minimize_flow_depth(data, close, levels, kernel, options);
  estimate.T_curr_prev = solution.T_curr_prev;
  estimate.iterations = solution.iterations;
  estimate.cost = solution.at_optimum.cost;
  if (!std::isfinite(estimate.cost) || !estimate.T_curr_prev.is_finite()) return estimate;
  evaluate_points(data, solution.T_curr_prev, levels, at);
  constexpr double gate = 3.0 * 3.0;
  for (size_t i = 0; i < data.size(); ++i) {
    estimate.inliers[i] = data.used(i) && at.q[i] <= gate ? 1 : 0;
    data.use(i, estimate.inliers[i] != 0, false);
  }
  const Matrix6d hessian = accumulate(data, solution.T_curr_prev, levels, {}).hessian;
  if (data.n_used() < min_points || !is_determined(hessian)) return estimate;
  estimate.covariance =
      std::max(variance_factor(data, at.q, kernel), 1.0) * hessian.ldlt().solve(Matrix6d::Identity());
  estimate.status = Status::ok;
  return estimate;
}

}  // namespace

bool is_determined(const Matrix6d& hessian) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(hessian, Eigen::EigenvaluesOnly);
  return eigen.info() == Eigen::Success && eigen.eigenvalues()[0] * max_condition > eigen.eigenvalues()[5];
}

void MotionOnlyOptions::check() const {
  check_option(sigma_px > 0, "sigma_px", sigma_px, "> 0");
  check_option(huber > 0, "huber", huber, "> 0");
  check_robust(robust);
}

MotionEstimate estimate_with_kernel(const Problem& problem, const StartingPoint& start, HuberKernel kernel,
                                    const std::string& robust, const SolverOptions& options) {
  if (robust == "geman_mcclure_gnc") return estimate_graduated(problem, start, options);
  if (robust == "none") kernel.threshold = std::numeric_limits<double>::infinity();
  MotionEstimate estimate;
  estimate.inliers = start.inliers;
  estimate.refined_flow_u = problem.points.flow_u;
  estimate.refined_flow_v = problem.points.flow_v;
  const ReprojectionData data(problem, start.inliers);
  if (data.size() < min_points) {
    estimate.status = Status::too_few_points;
    return estimate;
  }
  const SolverResult solution = minimize_reprojection(data, start.T_curr_prev, kernel, options);
  estimate.T_curr_prev = solution.T_curr_prev;
  estimate.iterations = solution.iterations;
  estimate.cost = solution.at_optimum.cost;
  if (!std::isfinite(estimate.cost) || !estimate.T_curr_prev.is_finite() ||
      !is_determined(solution.at_optimum.hessian)) {
    return estimate;  // diverged
  }
  estimate.covariance = solution.at_optimum.hessian.ldlt().solve(Matrix6d::Identity());
  estimate.status = Status::ok;
  return estimate;
}

MotionEstimate MotionOnly::estimate(const Problem& problem, const StartingPoint& start) const {
  return estimate_with_kernel(problem, start, {options_.sigma_px, options_.huber}, options_.robust,
                              options_.solver);
}

}  // namespace sextant
