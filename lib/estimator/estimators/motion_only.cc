#include "sextant/estimator/estimators/motion_only.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/estimator/solvers/degeneracy.h"
#include "sextant/estimator/solvers/graduation.h"
#include "sextant/estimator/solvers/noise_levels.h"

namespace sextant {
namespace {

MotionEstimate estimate_graduated(const Problem& problem, const StartingPoint& start,
                                  const SolverOptions& options) {
  MotionEstimate estimate = begin_estimate(problem, {});
  if (estimate.status != Status::ok) return estimate;
  FlowDepthData data(problem);
  RoughFlowDepthData rough(data);
  evaluate_points(rough, start.T_curr_prev, {});
  for (size_t i = 0; i < data.size(); ++i) {
    rough.use(i, std::isfinite(rough.q(i)), false);
    data.use(i, rough.used(i), false);
  }
  LevelSample sample(rough, start);
  const SE3 close = graduate(rough, start.T_curr_prev,
                             estimate_reprojection_level(sample, LevelsOf::inliers, start.T_curr_prev));
  const NoiseLevels levels = estimate_reprojection_level(sample, LevelsOf::all, close);
  const RobustKernel kernel{RobustKernel::Kind::geman_mcclure, last_graduated_scale};
  const SolverResult solution = minimize_flow_depth(data, close, levels, kernel, options);
  if (!take_solution(solution, estimate)) return estimate;
  evaluate_points(data, solution.T_curr_prev, levels);
  constexpr double gate = 3.0 * 3.0;
  for (size_t i = 0; i < data.size(); ++i) {
    estimate.inliers[i] = data.used(i) && data.q(i) <= gate ? 1 : 0;
    data.use(i, estimate.inliers[i] != 0, false);
  }
  conclude(problem, accumulate(data, solution.T_curr_prev, levels, {}).hessian,
           std::max(variance_factor(data, kernel), 1.0), estimate);
  return estimate;
}

}  // namespace

void MotionOnlyOptions::check() const {
  check_option(sigma_px > 0, "sigma_px", sigma_px, "> 0");
  check_option(huber > 0, "huber", huber, "> 0");
}

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

MotionEstimate MotionOnly::estimate(const Problem& problem, const StartingPoint& start) const {
  const HuberKernel kernel{options_.sigma_px, options_.huber};
  MotionEstimate estimate = estimate_with_kernel(problem, start, kernel, options_.robust, options_.solver);
  if (options_.covariance == CovarianceOf::correlated && estimate.status == Status::ok)
    correlate(problem, kernel, estimate);
  return estimate;
}

}  // namespace sextant
