#pragma once

// Robust kernels on a squared Mahalanobis distance q:
//
//   none            rho(q) = q
//   huber           rho(q) = q for q <= k^2, 2 k sqrt(q) - k^2 beyond          (Huber 1964)
//   geman_mcclure   rho(q) = c^2 q / (c^2 + q), redescending                  (Geman & McClure 1985)
//
// weight = rho'(q): rho(r^T r) has the same gradient as weight * r^T r with a constant weight.

#include <cmath>
#include <limits>
#include <type_traits>

#include "sextant/base/simd.h"

namespace sextant {

/// Huber's kernel of a residual r with standard deviation s, as a function of n2 = |r|^2 (in the squared
/// unit of s): n2 / s^2 for |r| <= k s, 2 k |r| / s - k^2 beyond. k = infinity gives least squares.
template <typename Real>
struct Huber {
  Real inside2;      ///< (k s)^2
  Real information;  ///< 1 / s^2
  Real slope;        ///< k / s
  Real offset;       ///< k^2

  Huber(Real sigma, Real threshold)
      : inside2(threshold * sigma * (threshold * sigma)),
        information(1 / (sigma * sigma)),
        slope(std::isfinite(threshold) ? threshold / sigma : Real(0)),
        offset(std::isfinite(threshold) ? threshold * threshold : Real(0)) {}
};

/// Weight and cost of the kernel at n2, which is one number, or lanes of numbers (geometry/lanes.h).
template <typename Value>
struct HuberAt {
  decltype(Value{} <= Value{}) inside;
  Value weight;  ///< d cost / d n2
  Value cost;

  template <typename Real>
  SEXTANT_INLINED HuberAt(const Huber<Real>& kernel, const Value& n2) : inside(n2 <= kernel.inside2) {
    const Value one = Value{} + Real(1);
    Value norm = inside ? one : n2;
    if constexpr (std::is_floating_point_v<Value>) {
      norm = std::sqrt(norm);
    } else {
      for (size_t k = 0; k < sizeof(Value) / sizeof(Real); ++k) norm[k] = std::sqrt(norm[k]);
    }
    weight = inside ? Value{} + kernel.information : kernel.slope / norm;
    cost = inside ? kernel.information * n2 : Real(2) * kernel.slope * norm - kernel.offset;
  }
};

struct RobustKernel {
  enum class Kind { none, huber, geman_mcclure };
  Kind kind = Kind::none;
  double scale = 0;  ///< k or c, in sigmas; unused for `none`

  double cost(double q) const {
    if (kind == Kind::huber) return huber(q).cost;
    const double s2 = scale * scale;
    return kind == Kind::geman_mcclure ? s2 * q / (s2 + q) : q;
  }
  double weight(double q) const {
    if (kind == Kind::huber) return huber(q).weight;
    const double share = root_weight(q);
    return kind == Kind::geman_mcclure ? share * share : 1;
  }
  /// Returns 2 q rho''(q) <= 0: the difference of the curvature along the residual from that of IRLS.
  double curvature_term(double q) const {
    if (kind == Kind::huber) return huber(q).inside ? 0 : -huber(q).weight;
    const double share = root_weight(q);
    return kind == Kind::geman_mcclure ? -4 * share * share * (1 - share) : 0;
  }
  /// Returns rho''(q).
  double weight_slope(double q) const {
    if (kind == Kind::huber) return huber(q).inside ? 0 : -0.5 * huber(q).weight / q;
    const double share = root_weight(q);
    return kind == Kind::geman_mcclure ? -2 * share * share * share / (scale * scale) : 0;
  }

 private:
  HuberAt<double> huber(double q) const { return {Huber<double>(1, scale), q}; }
  double root_weight(double q) const { return scale * scale / (scale * scale + q); }
};

/// Huber's kernel of a residual by its parameters; Huber<Real> has its precomputed constants.
struct HuberKernel {
  double sigma_px = 1.0;
  double threshold = std::numeric_limits<double>::infinity();  ///< in units of sigma_px

  double threshold_px() const { return threshold * sigma_px; }
};

}  // namespace sextant
