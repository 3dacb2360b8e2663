#pragma once

// The Huber kernel on a 2-vector residual r, and the closed form of the joint problem (METHOD section 3).
//
//   cost of one residual:  h(r) = |r|^2 / s^2                     for |r| <= k s
//                                 2 k |r| / s - k^2               beyond
//   s = sigma_px, k = threshold (in sigmas; infinite = plain least squares).
//
// Infimal convolution: min over a + b = r of h1(a) + h2(b) is again a Huber kernel with
//   s^2 = s1^2 + s2^2,   k = s min(k1 / s1, k2 / s2),
// because the convex conjugates add: h_i*(y) = s_i^2 |y|^2 / 4 on |y| <= 2 k_i / s_i. So minimising over
// every refined flow first leaves the reprojection problem with one effective kernel, and the minimiser is
// recovered per point by split_residual().

#include <cmath>
#include <limits>

#include <Eigen/Core>

namespace sextant {

struct HuberKernel {
  double sigma_px = 1.0;
  double threshold = std::numeric_limits<double>::infinity();  ///< in units of sigma

  double threshold_px() const { return threshold * sigma_px; }
  double cost(double norm_px) const {
    const double x = norm_px / sigma_px;
    return x <= threshold ? x * x : 2 * threshold * x - threshold * threshold;
  }
};

/// The kernel of min over the split of r into a + b.
HuberKernel infimal_convolution(const HuberKernel& projection, const HuberKernel& flow);

/// The part b of r that the flow takes at the optimum; a = r - b stays with the projection. Where both
/// terms reach their caps together, the optimum is a segment: the excess is then shared by variance.
Eigen::Vector2d split_residual(const Eigen::Vector2d& r, const HuberKernel& projection,
                               const HuberKernel& flow);

}  // namespace sextant
