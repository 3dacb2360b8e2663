#include "sextant/estimator/graduation.h"

#include <cmath>

namespace sextant {

SE3 graduate(const FlowDepthData& all, const SE3& start, const NoiseLevels& levels) {
  constexpr size_t sample_size = 1000;
  constexpr double first = 8;
  constexpr double last = last_graduated_scale;
  constexpr int steps = 6;
  FlowDepthData data = all.sample(sample_size);
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

double variance_factor(const FlowDepthData& data, const std::vector<double>& q, const RobustKernel& kernel,
                       size_t stride) {
  double square = 0;
  double slope = 0;
  size_t n = 0;
  for (size_t i = 0; i < data.size(); i += stride) {
    if (!data.used(i)) continue;
    const double d = data.uses_depth_curr(i) ? 3 : 2;
    const double w = kernel.weight(q[i]);
    square += w * w * q[i] / d;
    slope += w + 2 * q[i] * kernel.weight_slope(q[i]) / d;
    ++n;
  }
  return slope > 0 ? static_cast<double>(n) * square / (slope * slope) : INFINITY;
}

}  // namespace sextant
