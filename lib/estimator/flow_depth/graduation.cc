#include "sextant/estimator/flow_depth/graduation.h"

#include <algorithm>
#include <cmath>

#include "sextant/estimator/flow_depth/noise_levels.h"
#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {

SE3 graduate(const RoughFlowDepthData& all, const SE3& start, const NoiseLevels& levels) {
  constexpr size_t sample_size = 1000;
  constexpr double first = 8;
  constexpr double last = last_graduated_scale;
  constexpr int steps = 6;
  RoughFlowDepthData data = all.sample(sample_size);
  RobustKernel kernel{RobustKernel::Kind::geman_mcclure, last};
  const SolverResult direct = descend(data, start, levels, kernel, 10);
  std::optional<SE3> X = start;
  for (int k = 0; k + 1 < steps && X; ++k) {
    kernel.scale = first * std::pow(last / first, k / (steps - 1.0));
    X = step_flow_depth(data, *X, levels, kernel);
  }
  if (!X) return direct.T_curr_prev;
  kernel.scale = last;
  const SolverResult graduated = descend(data, *X, levels, kernel, 5);
  return graduated.at_optimum.cost < direct.at_optimum.cost ? graduated.T_curr_prev : direct.T_curr_prev;
}

template <typename Real>
double variance_factor(const FlowDepthPoints<Real>& data, const RobustKernel& kernel) {
  constexpr double n_parameters = 6;
  double n_points = 0;
  double n_residuals = 0;
  double squares = 0;
  double slopes = 0;
  double squared_slopes = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.used(i)) continue;
    const double d = data.uses_depth_curr(i) ? 3 : 2;
    const double q = data.q(i);
    const double w = kernel.weight(q);
    const double slope = w + kernel.curvature_term(q) / d;
    n_points += 1;
    n_residuals += d;
    squares += w * w * q / d;
    slopes += slope;
    squared_slopes += slope * slope;
  }
  if (!(slopes > 0)) return INFINITY;
  const double mean_slope = slopes / n_points;
  const double asymptotic = squares / n_points / (mean_slope * mean_slope);
  if (n_residuals <= n_parameters) return asymptotic;
  const double relative_variance = squared_slopes / n_points / (mean_slope * mean_slope) - 1;
  const double K = 1 + n_parameters / n_residuals * relative_variance;
  return K * K * n_residuals / (n_residuals - n_parameters) * asymptotic;
}

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

template double variance_factor(const FlowDepthPoints<double>&, const RobustKernel&);
template double variance_factor(const FlowDepthPoints<float>&, const RobustKernel&);

}  // namespace sextant
