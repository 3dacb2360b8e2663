#pragma once

// The closed form of the joint problem (docs/method.md, "The joint problem has a closed form"), whose terms
// have Huber's kernel h (robust_kernel.h) with s = sigma_px and k = threshold.
//
// Infimal convolution: min over a + b = r of h1(a) + h2(b) is again a Huber kernel with
//   s^2 = s1^2 + s2^2,   k = s min(k1 / s1, k2 / s2),
// because the convex conjugates add: h_i*(y) = s_i^2 |y|^2 / 4 on |y| <= 2 k_i / s_i. So minimising over
// every refined flow first leaves the reprojection problem with one effective kernel, and the minimiser is
// recovered per point by split_residual().

#include <limits>

#include <Eigen/Core>

namespace sextant {

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
