#pragma once

// Speed and rigid motion of an object between the previous and the current frame, in the reference frames
// that the literature uses. X = T_curr_prev of the object maps its points from previous to current camera
// coordinates and includes the camera's own motion.
//
//   H        in previous camera coordinates  H = X_0^-1 X (paper eq. (9)), X_0 = X of the background
//   H_world  in the world                    H_world = T_world_curr X T_world_prev^-1
//   H_body   in the object's own frame       L^-1 H L, L = T_camera_object at the previous frame
//   v        speed, m/s                      |t - (I - R) c| / dt = |H c - c| / dt (paper sec. V, after
//                                            Chirikjian et al. 2017), c = centroid of the object's points,
//                                            same frame as H
//
// If c is the origin of the object's label box, v is the displacement of that origin divided by dt, as the
// paper's published code computes it.

#include "sextant/geometry/se3.h"

namespace sextant {

constexpr double kmh_per_mps = 3.6;

/// Returns H, the object's motion in previous camera coordinates.
inline SE3 object_motion_prev(const SE3& T_curr_prev_background, const SE3& T_curr_prev_object) {
  return T_curr_prev_background.inverse() * T_curr_prev_object;
}

/// Returns H_world, the object's motion in world coordinates.
inline SE3 world_motion(const SE3& T_world_prev, const SE3& T_world_curr, const SE3& T_curr_prev_object) {
  return T_world_curr * T_curr_prev_object * T_world_prev.inverse();
}

/// Returns H_body, the object's motion in its own frame.
inline SE3 body_motion(const SE3& H_prev_camera, const SE3& T_camera_object_prev) {
  return T_camera_object_prev.inverse() * H_prev_camera * T_camera_object_prev;
}

/// Returns the speed v (m/s) of the point `centroid`, which is given in the frame of H.
inline double speed_mps(const SE3& H, const Eigen::Vector3d& centroid, double dt_s) {
  return (H * centroid - centroid).norm() / dt_s;
}

/// Returns the speed v in km/h; see speed_mps().
inline double velocity_kmh(const SE3& H, const Eigen::Vector3d& centroid, double dt_s) {
  return speed_mps(H, centroid, dt_s) * kmh_per_mps;
}

}  // namespace sextant
