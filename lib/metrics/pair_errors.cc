#include "sextant/metrics/pair_errors.h"

#include <cmath>

#include "sextant/base/error.h"

namespace sextant {

FlowError flow_error(std::span<const double> u, std::span<const double> v, std::span<const double> true_u,
                     std::span<const double> true_v) {
  SEXTANT_CHECK(u.size() == v.size() && u.size() == true_u.size() && u.size() == true_v.size());
  FlowError sum;
  for (size_t i = 0; i < u.size(); ++i) {
    const double du = u[i] - true_u[i];
    const double dv = v[i] - true_v[i];
    if (!std::isfinite(du) || !std::isfinite(dv)) continue;
    sum.epe_px += std::hypot(du, dv);
    sum.x_px += std::abs(du);
    sum.y_px += std::abs(dv);
    ++sum.n;
  }
  const double n = sum.n > 0 ? sum.n : NAN;
  return {sum.epe_px / n, sum.x_px / n, sum.y_px / n, sum.n};
}

PointFlow induced_flow(const PinholeCamera& camera, const SE3& T_curr_prev, const Correspondences& points) {
  PointFlow flow;
  flow.u.reserve(points.size());
  flow.v.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = T_curr_prev * camera.backproject(points.u[i], points.v[i], points.depth[i]);
    const Eigen::Vector2d uv =
        p.z() > 0 ? camera.project(p) : Eigen::Vector2d(Eigen::Vector2d::Constant(NAN));
    flow.u.push_back(uv.x() - points.u[i]);
    flow.v.push_back(uv.y() - points.v[i]);
  }
  return flow;
}

}  // namespace sextant
