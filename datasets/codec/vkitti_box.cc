#include "sextant/datasets/codec/vkitti_box.h"

#include <cmath>
#include <numbers>

namespace sextant {

Eigen::Quaterniond vkitti_rotation(const VkittiAngles& angles) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return Eigen::Quaterniond(AngleAxisd(angles.ry + vkitti_yaw_offset_rad, Vector3d::UnitY()) *
                            AngleAxisd(angles.rx, Vector3d::UnitX()) *
                            AngleAxisd(angles.rz, Vector3d::UnitZ()));
}

VkittiAngles vkitti_angles(const Eigen::Quaterniond& R_camera_object) {
  // Row 1 of Ry Rx Rz is [cx sz, cx cz, -sx], column 2 is [sy cx, -sx, cy cx].
  const Eigen::Matrix3d r = R_camera_object.toRotationMatrix();
  const double yaw = std::atan2(r(0, 2), r(2, 2)) - vkitti_yaw_offset_rad;
  return {std::remainder(yaw, 2 * std::numbers::pi), std::atan2(-r(1, 2), std::hypot(r(1, 0), r(1, 1))),
          std::atan2(r(1, 0), r(1, 1))};
}

}  // namespace sextant
