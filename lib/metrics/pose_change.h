#pragma once

// Pose change error of one step (paper sec. V):  E = Xhat^-1 X,  E_t = |trans(E)| (m),
// E_R = angle(E) (deg), the angle as 2 atan2(|q_v|, |q_w|) in double.
//
// Which X: `camera`: T_curr_prev of the object; the ego motion: T_prev_curr.
// `world` (published code): H_world = T_world_curr X T_world_prev^-1, estimate in the estimate's own world,
// so it contains the camera's drift and depends on the distance to the world's origin. `body` (VDO-SLAM,
// DynOSAM RME): L^-1 H L with L = T_camera_object at the previous frame.

#include "sextant/geometry/se3.h"

namespace sextant {

struct PoseChangeError {
  double Et_m = 0;
  double ER_deg = 0;
};

PoseChangeError pose_change_error(const SE3& estimate, const SE3& truth);

/// H_world of one object step.
SE3 world_motion(const SE3& T_world_prev, const SE3& T_world_curr, const SE3& T_curr_prev_object);

/// L^-1 H L: an object's motion in its own frame at the previous instant, from H in previous camera
/// coordinates.
SE3 body_motion(const SE3& H_prev_camera, const SE3& T_camera_object_prev);

}  // namespace sextant
