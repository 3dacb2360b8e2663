#include "sextant/estimator/motion_only.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

// Six unknowns need three points; a Hessian with a worse condition leaves some direction to chance.
constexpr size_t min_points = 3;
constexpr double max_condition = 1e14;

}  // namespace

bool is_determined(const Matrix6d& hessian) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(hessian, Eigen::EigenvaluesOnly);
  return eigen.info() == Eigen::Success && eigen.eigenvalues()[0] * max_condition > eigen.eigenvalues()[5];
}

void MotionOnlyOptions::check() const {
  check_option(sigma_px > 0, "sigma_px", sigma_px, "> 0");
  check_option(huber > 0, "huber", huber, "> 0");
}

MotionEstimate estimate_with_kernel(const Problem& problem, const StartingPoint& start,
                                    const HuberKernel& kernel, const SolverOptions& options) {
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
  return estimate_with_kernel(problem, start, {options_.sigma_px, options_.huber}, options_.solver);
}

}  // namespace sextant
