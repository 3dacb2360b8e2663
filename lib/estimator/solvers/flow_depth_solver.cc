#include "sextant/estimator/solvers/flow_depth_solver.h"

#include <cmath>
#include <limits>

#include "sextant/estimator/solvers/flow_depth_lanes.h"

namespace sextant {
namespace {

bool is_positive(const Matrix6d& hessian) { return Eigen::LLT<Matrix6d>(hessian).info() == Eigen::Success; }

FlowDepthLoop loop_of(Curvature curvature, const NoiseLevels& levels) {
  if (curvature == Curvature::rough) return FlowDepthLoop::rough;
  return curvature == Curvature::newton && !levels.as_measured ? FlowDepthLoop::newton
                                                               : FlowDepthLoop::gauss_newton;
}

template <typename Real>
void evaluate(FlowDepthLoop loop, FlowDepthPoints<Real>& data, const SE3& T_curr_prev,
              const NoiseLevels& levels) {
  run_loop(loop, data, T_curr_prev, levels, {});
  Real* q = data.column(FlowDepthPoints<Real>::squared_distance);
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.is_measurement(i)) q[i] = std::numeric_limits<Real>::infinity();
  }
}

}  // namespace

template <typename Real>
void evaluate_points(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels) {
  evaluate(FlowDepthLoop::points, data, T_curr_prev, levels);
}

template <typename Real>
void evaluate_distances(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels) {
  evaluate(FlowDepthLoop::distances, data, T_curr_prev, levels);
}

template <typename Real>
NormalEquations accumulate(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                           const RobustKernel& kernel, Curvature curvature) {
  return equations_of(run_loop(loop_of(curvature, levels), data, T_curr_prev, levels, kernel));
}

template <typename Real>
std::optional<SE3> step_flow_depth(FlowDepthPoints<Real>& data, const SE3& from, const NoiseLevels& levels,
                                   const RobustKernel& kernel, double* size) {
  const NormalEquations at = accumulate(data, from, levels, kernel, Curvature::rough);
  const Vector6d step = at.hessian.ldlt().solve(-at.gradient);
  if (!std::isfinite(at.cost) || !step.allFinite()) return std::nullopt;
  const SE3 to = SE3::exp(step) * from;
  if (size != nullptr) *size = step.cwiseAbs().maxCoeff();
  return to.is_finite() ? std::optional(to) : std::nullopt;
}

SolverResult descend(RoughFlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, int max_iterations) {
  return minimize_on_se3([&](const SE3& X) { return accumulate(data, X, levels, kernel, Curvature::rough); },
                         start, {.max_iterations = max_iterations, .step_tolerance = 1e-5},
                         rounding_of_sums<float>);
}

SolverResult minimize_flow_depth(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                                 const RobustKernel& kernel, const SolverOptions& options,
                                 const MotionPrior& prior) {
  return minimize_on_se3(
      [&](const SE3& X) {
        NormalEquations at = accumulate(data, X, levels, kernel, Curvature::newton);
        if (prior.holds()) add_prior(prior, X, at);
        at.is_exact = is_positive(at.hessian);
        if (!std::isfinite(at.cost) || at.is_exact) return at;
        at = accumulate(data, X, levels, kernel, Curvature::gauss_newton);
        if (prior.holds()) add_prior(prior, X, at);
        return at;
      },
      start, options);
}

template void evaluate_points(FlowDepthPoints<double>&, const SE3&, const NoiseLevels&);
template void evaluate_points(FlowDepthPoints<float>&, const SE3&, const NoiseLevels&);
template void evaluate_distances(FlowDepthPoints<float>&, const SE3&, const NoiseLevels&);
template NormalEquations accumulate(FlowDepthPoints<double>&, const SE3&, const NoiseLevels&,
                                    const RobustKernel&, Curvature);
template NormalEquations accumulate(FlowDepthPoints<float>&, const SE3&, const NoiseLevels&,
                                    const RobustKernel&, Curvature);
template std::optional<SE3> step_flow_depth(FlowDepthPoints<double>&, const SE3&, const NoiseLevels&,
                                            const RobustKernel&, double*);
template std::optional<SE3> step_flow_depth(FlowDepthPoints<float>&, const SE3&, const NoiseLevels&,
                                            const RobustKernel&, double*);

}  // namespace sextant
