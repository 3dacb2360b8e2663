#include "sextant/geometry/camera.h"

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/geometry/se3.h"

namespace sextant {

Eigen::Matrix<double, 2, 6> PinholeCamera::motion_jacobian(const Eigen::Vector3d& p) const {
  const Eigen::Matrix<double, 2, 3> j = project_jacobian(p);
  Eigen::Matrix<double, 2, 6> full;
  full << j, -j * skew(p);  // exp(xi) p = p + rho + omega x p + ...
  return full;
}

void PinholeCamera::check() const {
  const bool finite = std::isfinite(fx) && std::isfinite(fy) && std::isfinite(cx) && std::isfinite(cy);
  if (!finite || fx <= 0 || fy <= 0) {
    fail("camera fx={} fy={} cx={} cy={}: expected finite numbers with fx > 0 and fy > 0", fx, fy, cx, cy);
  }
}

Eigen::Vector3d StereoCamera::project(const Eigen::Vector3d& p) const {
  const Eigen::Vector2d uv = left.project(p);
  return {uv.x(), uv.y(), uv.x() - bf / p.z()};
}

Eigen::Matrix3d StereoCamera::project_jacobian(const Eigen::Vector3d& p) const {
  Eigen::Matrix3d j;
  j.topRows<2>() = left.project_jacobian(p);
  j.row(2) = j.row(0);
  j(2, 2) += bf / (p.z() * p.z());
  return j;
}

void StereoCamera::check() const {
  left.check();
  if (!std::isfinite(bf) || bf <= 0) fail("camera bf={}: expected a finite number > 0 (px m)", bf);
}

}  // namespace sextant
