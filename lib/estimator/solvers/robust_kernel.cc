#include "sextant/estimator/solvers/robust_kernel.h"

#include <algorithm>
#include <cmath>

namespace sextant {

HuberKernel infimal_convolution(const HuberKernel& projection, const HuberKernel& flow) {
  const double s = std::hypot(projection.sigma_px, flow.sigma_px);
  return {s, s * std::min(projection.threshold / projection.sigma_px, flow.threshold / flow.sigma_px)};
}

Eigen::Vector2d split_residual(const Eigen::Vector2d& r, const HuberKernel& projection,
                               const HuberKernel& flow) {
  const double variance_projection = projection.sigma_px * projection.sigma_px;
  const double variance_flow = flow.sigma_px * flow.sigma_px;
  const double share = variance_flow / (variance_projection + variance_flow);
  const HuberKernel joint = infimal_convolution(projection, flow);
  const double norm = r.norm();
  if (norm <= joint.threshold_px()) return share * r;
  // Above the cap the influence is constant: the capped term takes the rest, and the other one does not grow
  // any further.
  const double cap_projection = projection.threshold / projection.sigma_px;
  const double cap_flow = flow.threshold / flow.sigma_px;
  const Eigen::Vector2d at_cap = joint.threshold_px() / norm * r;
  if (cap_projection < cap_flow) return share * at_cap;
  if (cap_flow < cap_projection) return r - (1 - share) * at_cap;
  return share * r;
}

}  // namespace sextant
