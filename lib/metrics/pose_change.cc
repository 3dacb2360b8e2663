#include "sextant/metrics/pose_change.h"

#include <numbers>

namespace sextant {

PoseChangeError pose_change_error(const SE3& estimate, const SE3& truth) {
  const SE3 error = estimate.inverse() * truth;
  return {error.translation().norm(), rotation_angle_rad(error.rotation()) * 180.0 / std::numbers::pi};
}

SE3 world_motion(const SE3& T_world_prev, const SE3& T_world_curr, const SE3& T_curr_prev_object) {
  return T_world_curr * T_curr_prev_object * T_world_prev.inverse();
}

SE3 body_motion(const SE3& H_prev_camera, const SE3& T_camera_object_prev) {
  return T_camera_object_prev.inverse() * H_prev_camera * T_camera_object_prev;
}

}  // namespace sextant
