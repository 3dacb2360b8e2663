#pragma once

// Levenberg-Marquardt on SE(3) with left perturbation X <- exp(xi) X: the outer loop of all solvers.

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sextant/base/options.h"
#include "sextant/geometry/lanes.h"
#include "sextant/geometry/se3.h"

namespace sextant {

struct SolverOptions {
  SEXTANT_OPTIONS(
      (int, max_iterations, 100, "count", "largest number of Levenberg-Marquardt steps"),
      (double, step_tolerance, 1e-12, "m, rad",
       "stop when the largest component of a step is smaller or, for exact Newton steps, the error that "
       "remains after the step"))
  void check() const;
};

/// Cost, gradient and (Gauss-)Newton Hessian at X; the cost is +inf if a point is not in front of the camera.
struct NormalEquations {
  double cost = 0;
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
  bool is_exact = false;  ///< true for the exact Hessian of the cost, with which steps converge quadratically
};

struct SolverResult {
  SE3 T_curr_prev;
  NormalEquations at_optimum;
  int iterations = 0;
  bool converged = false;
};

/// Minimises a cost over SE(3). `accumulate`: const SE3& -> NormalEquations; `rounding`: relative rounding
/// error of the cost, below which changes are ignored.
template <typename Accumulate>
SolverResult minimize_on_se3(Accumulate&& accumulate, const SE3& start, const SolverOptions& options,
                             double rounding = 1e-12) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  // bound on third over second derivatives (1/m, 1/rad), for the error after a Newton step
  constexpr double third_over_second = 1e3;
  SolverResult result;
  result.T_curr_prev = start;
  NormalEquations at = accumulate(start);
  double damping = 1e-6;
  double last_step_size = infinity;
  bool usable = std::isfinite(at.cost);
  while (usable && !result.converged && result.iterations < options.max_iterations) {
    ++result.iterations;
    Matrix6d damped = at.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::LDLT<Matrix6d> ldlt(damped);
    const Vector6d step = ldlt.solve(-at.gradient);
    if (ldlt.info() != Eigen::Success || !step.allFinite()) {
      damping = std::max(damping * 10, 1e-6);
      usable = damping < 1e12;
      continue;
    }
    const SE3 candidate = SE3::exp(step) * result.T_curr_prev;
    const double step_size = step.cwiseAbs().maxCoeff();
    const double error =
        at.is_exact ? std::min(step_size, third_over_second * step_size * step_size) : step_size;
    if (error < options.step_tolerance && candidate.is_finite()) {
      // The cost at the candidate is predicted, without another evaluation.
      at.cost += at.gradient.dot(step) + 0.5 * step.dot(at.hessian * step);
      result.T_curr_prev = candidate;
      result.converged = true;
      break;
    }
    const NormalEquations next = accumulate(candidate);
    // Near the optimum the cost does not resolve a step any more; then the step sizes themselves must
    // decrease.
    const double resolution = rounding * at.cost;
    const bool unresolved = std::abs(next.cost - at.cost) <= resolution;
    const bool improves = unresolved ? step_size < last_step_size : next.cost < at.cost;
    if (improves) {
      result.T_curr_prev = candidate;
      at = next;
      damping = std::max(damping * 0.1, 1e-15);
      last_step_size = step_size;
    } else if (unresolved) {
      result.converged = true;  // neither cost nor step size decreases in double precision
    } else {
      damping *= 10;
      usable = damping < 1e12;
    }
  }
  result.at_optimum = at;
  return result;
}

// Sums of the normal equations, over lanes of points and as numbers.

inline constexpr int n_hessian = 21;  // upper triangle, row by row
/// Hessian (21), gradient (6), sum of rho, number of points behind the camera.
using NormalSums = std::array<double, n_hessian + 8>;

template <typename Real>
struct NormalLanes {
  LanesOf<Real> hessian[n_hessian] = {};
  LanesOf<Real> gradient[6] = {};
  LanesOf<Real> cost = {};    ///< sum of rho
  LanesOf<Real> behind = {};  ///< number of points behind the camera

  SEXTANT_INLINED void store(NormalSums& sums) const {
    for (int k = 0; k < n_hessian; ++k) sums[k] = sum_of_lanes(&hessian[k]);
    for (int k = 0; k < 6; ++k) sums[n_hessian + k] = sum_of_lanes(&gradient[k]);
    sums[n_hessian + 6] = sum_of_lanes(&cost);
    sums[n_hessian + 7] = sum_of_lanes(&behind);
  }
};

inline NormalEquations equations_of(const NormalSums& sums) {
  NormalEquations out;
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) out.hessian(a, b) = out.hessian(b, a) = sums[k++];
  }
  for (int a = 0; a < 6; ++a) out.gradient[a] = sums[k++];
  out.cost = sums[k + 1] > 0 ? std::numeric_limits<double>::infinity() : 0.5 * sums[k];
  return out;
}

}  // namespace sextant
