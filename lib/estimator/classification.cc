#include "sextant/estimator/classification.h"

#include <cmath>

namespace sextant {

void ClassificationOptions::check() const {
  check_option(min_speed_mps > 0, "min_speed_mps", min_speed_mps, "> 0");
  check_option(min_moving_share >= 0 && min_moving_share < 1, "min_moving_share", min_moving_share,
               "in [0, 1)");
}

MotionClass classify_motion(const Problem& object, const SE3& T_curr_prev_background, double dt_s,
                            const ClassificationOptions& options) {
  const SE3 T_prev_curr = T_curr_prev_background.inverse();
  const PinholeCamera& camera = object.camera.left;
  const Correspondences& points = object.points;
  const double threshold_m = options.min_speed_mps * dt_s;
  int n_moving = 0;
  MotionClass result;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points.depth_curr[i])) continue;
    const Eigen::Vector3d m_prev = camera.backproject(points.u[i], points.v[i], points.depth[i]);
    const Eigen::Vector3d m_curr = camera.backproject(points.u[i] + points.flow_u[i],
                                                      points.v[i] + points.flow_v[i], points.depth_curr[i]);
    const Eigen::Vector3d f = m_prev - T_prev_curr * m_curr;
    const double length_m = options.use_vertical ? f.norm() : std::sqrt(f.x() * f.x() + f.z() * f.z());
    ++result.n_points;
    n_moving += length_m > threshold_m ? 1 : 0;
  }
  result.moving_share = result.n_points > 0 ? static_cast<double>(n_moving) / result.n_points : NAN;
  result.is_dynamic = result.n_points == 0 || result.moving_share > options.min_moving_share;
  return result;
}

}  // namespace sextant
