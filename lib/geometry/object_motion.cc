#include "sextant/geometry/object_motion.h"

namespace sextant {

SE3 object_motion_prev(const SE3& T_curr_prev_background, const SE3& T_curr_prev_object) {
  return T_curr_prev_background.inverse() * T_curr_prev_object;
}

SE3 world_motion(const SE3& T_world_prev, const SE3& T_world_curr, const SE3& T_curr_prev_object) {
  return T_world_curr * T_curr_prev_object * T_world_prev.inverse();
}

SE3 body_motion(const SE3& H_prev_camera, const SE3& T_camera_object_prev) {
  return T_camera_object_prev.inverse() * H_prev_camera * T_camera_object_prev;
}

double speed_mps(const SE3& H, const Eigen::Vector3d& centroid, double dt_s) {
  return (H * centroid - centroid).norm() / dt_s;
}

double velocity_kmh(const SE3& H, const Eigen::Vector3d& centroid, double dt_s) {
  return speed_mps(H, centroid, dt_s) * kmh_per_mps;
}

}  // namespace sextant
