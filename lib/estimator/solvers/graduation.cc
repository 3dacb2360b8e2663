#include "sextant/estimator/solvers/graduation.h"

#include <cmath>

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
  double square = 0;
  double slope = 0;
  size_t n = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.used(i)) continue;
    const double per_d = data.uses_depth_curr(i) ? 1.0 / 3 : 1.0 / 2;
    const double q = data.q(i);
    const double w = kernel.weight(q);
    square += w * w * q * per_d;
    slope += w + kernel.bend(q) * per_d;
    ++n;
  }
  return slope > 0 ? static_cast<double>(n) * square / (slope * slope) : INFINITY;
}

template double variance_factor(const FlowDepthPoints<double>&, const RobustKernel&);
template double variance_factor(const FlowDepthPoints<float>&, const RobustKernel&);

}  // namespace sextant
