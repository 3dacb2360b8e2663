#pragma once

// Orientation of the 3-D boxes of Virtual KITTI, 1.3.1 and 2.0.3 alike:
//
//   R_camera_object = Ry(ry + pi/2) Rx(rx) Rz(rz),   object axes x right, y down, z ahead (along the length).
//
// Evidence: with it the boxes of worlds 0001, 0002, 0018 stand upright in the world (median tilt below 0.001
// deg; without the offset before Rx and Rz they lean by 2.5 to 3.5 deg) and cars move along their z axis.
// Pose rows of 2.0.3 repeat the numbers of 1.3.1 (Scene18/clone, frame 25, track 0). docs/datasets.md.

#include <Eigen/Geometry>

namespace sextant {

/// m to the next frame from which on an object is flagged as moving: 0.1 m/s at 10 Hz.
constexpr double moving_step_m = 0.01;

inline constexpr double vkitti_yaw_offset_rad = 1.57079632679489661923;

struct VkittiAngles {
  double ry = 0, rx = 0, rz = 0;  ///< rad
};

Eigen::Quaterniond vkitti_rotation(const VkittiAngles& angles);
/// The inverse; |rx| <= pi/2, the others within [-pi, pi].
VkittiAngles vkitti_angles(const Eigen::Quaterniond& R_camera_object);

}  // namespace sextant
