#pragma once

// Robust kernels on a squared Mahalanobis distance q:
//
//   none            rho(q) = q
//   huber           rho(q) = q for q <= k^2, 2 k sqrt(q) - k^2 beyond          (Huber 1964)
//   geman_mcclure   rho(q) = c^2 q / (c^2 + q), redescending                  (Geman & McClure 1985)
//
// weight = rho'(q): a residual r with q = r^T r pulls like weight * r.

#include <cmath>

namespace sextant {

struct RobustKernel {
  enum class Kind { none, huber, geman_mcclure };
  Kind kind = Kind::none;
  double scale = 0;  ///< k or c, in sigmas; unused for none

  double cost(double q) const {
    const double s2 = scale * scale;
    if (kind == Kind::huber && q > s2) return 2 * scale * std::sqrt(q) - s2;
    return kind == Kind::geman_mcclure ? s2 * q / (s2 + q) : q;
  }
  double weight(double q) const {
    const double s2 = scale * scale;
    if (kind == Kind::huber && q > s2) return scale / std::sqrt(q);
    const double share = s2 / (s2 + q);
    return kind == Kind::geman_mcclure ? share * share : 1;
  }
  /// 2 q d weight / d q: by how much the pull of a residual along itself falls short of weight.
  double bend(double q) const {
    const double s2 = scale * scale;
    if (kind == Kind::huber) return q > s2 ? -scale / std::sqrt(q) : 0;
    const double share = s2 / (s2 + q);
    return kind == Kind::geman_mcclure ? -4 * share * share * (1 - share) : 0;
  }
  /// d weight / d q.
  double weight_slope(double q) const {
    const double s2 = scale * scale;
    if (kind == Kind::huber && q > s2) return -0.5 * weight(q) / q;
    const double share = s2 / (s2 + q);
    return kind == Kind::geman_mcclure ? -2 * share * share * share / s2 : 0;
  }
};

}  // namespace sextant
