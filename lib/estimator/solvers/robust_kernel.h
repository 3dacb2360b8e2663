#pragma once

// Robust kernels on a squared Mahalanobis distance q:
//
//   none            rho(q) = q
//   huber           rho(q) = q for q <= k^2, 2 k sqrt(q) - k^2 beyond          (Huber 1964)
//   geman_mcclure   rho(q) = c^2 q / (c^2 + q), redescending                  (Geman & McClure 1985)
//
// weight = rho'(q): a residual r with q = r^T r pulls like weight * r.

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <type_traits>

#include "sextant/base/simd.h"

namespace sextant {

/// Huber's kernel on a residual r of standard deviation s, from its square n2 = |r|^2 in the units of s:
/// n2 / s^2 for |r| <= k s, 2 k |r| / s - k^2 beyond. k = infinity: least squares.
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

/// The kernel at n2: one number, or lanes of them (geometry/lanes.h).
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
  double scale = 0;  ///< k or c, in sigmas; unused for none

  double cost(double q) const {
    if (kind == Kind::huber) return huber(q).cost;
    const double s2 = scale * scale;
    return kind == Kind::geman_mcclure ? s2 * q / (s2 + q) : q;
  }
  double weight(double q) const {
    if (kind == Kind::huber) return huber(q).weight;
    const double share = shrinking(q);
    return kind == Kind::geman_mcclure ? share * share : 1;
  }
  /// 2 q d weight / d q: by how much the pull of a residual along itself falls short of weight.
  double bend(double q) const {
    if (kind == Kind::huber) return huber(q).inside ? 0 : -huber(q).weight;
    const double share = shrinking(q);
    return kind == Kind::geman_mcclure ? -4 * share * share * (1 - share) : 0;
  }
  /// d weight / d q.
  double weight_slope(double q) const {
    if (kind == Kind::huber) return huber(q).inside ? 0 : -0.5 * huber(q).weight / q;
    const double share = shrinking(q);
    return kind == Kind::geman_mcclure ? -2 * share * share * share / (scale * scale) : 0;
  }

 private:
  HuberAt<double> huber(double q) const { return {Huber<double>(1, scale), q}; }
  double shrinking(double q) const { return scale * scale / (scale * scale + q); }
};

// The closed form of the joint problem (docs/method.md, "The joint problem has a closed form"), whose terms
// have Huber's kernel h (robust_kernel.h) with s = sigma_px and k = threshold.
//
// Infimal convolution: min over a + b = r of h1(a) + h2(b) is again a Huber kernel with
//   s^2 = s1^2 + s2^2,   k = s min(k1 / s1, k2 / s2),
// because the convex conjugates add: h_i*(y) = s_i^2 |y|^2 / 4 on |y| <= 2 k_i / s_i. So minimising over
// every refined flow first leaves the reprojection problem with one effective kernel, and the minimiser is
// recovered per point by split_residual().

struct HuberKernel {
  double sigma_px = 1.0;
  double threshold = std::numeric_limits<double>::infinity();  ///< in units of sigma

  double threshold_px() const { return threshold * sigma_px; }
};

/// The kernel of min over the split of r into a + b.
HuberKernel infimal_convolution(const HuberKernel& projection, const HuberKernel& flow);

/// The part b of r that the flow takes at the optimum; a = r - b stays with the projection. Where both
/// terms reach their caps together, the optimum is a segment: the excess is then shared by variance.
Eigen::Vector2d split_residual(const Eigen::Vector2d& r, const HuberKernel& projection,
                               const HuberKernel& flow);

}  // namespace sextant
