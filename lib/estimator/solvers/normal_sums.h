#pragma once

// The sums that make normal equations, over lanes of points and as numbers.

#include <array>
#include <limits>

#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/geometry/lanes.h"

namespace sextant {

inline constexpr int n_hessian = 21;  // upper triangle, row by row
/// Hessian (21), gradient (6), sum of rho, number of points behind the camera.
using NormalSums = std::array<double, n_hessian + 8>;

template <typename Real>
struct NormalLanes {
  LanesOf<Real> hessian[n_hessian] = {};
  LanesOf<Real> gradient[6] = {};
  LanesOf<Real> cost = {};    ///< sum of rho
  LanesOf<Real> behind = {};  ///< the camera

  [[gnu::always_inline]] void store(NormalSums& sums) const {
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
