#pragma once

// Pose change error of one step (paper sec. V):  E = Xhat^-1 X,  E_t = |trans(E)| (m),
// E_R = angle(E) (deg), the angle as 2 atan2(|q_v|, |q_w|) in double.
//
// Which X (geometry/object_motion.h): `camera`: T_curr_prev of the object; the ego motion: T_prev_curr.
// `world` (published code): H_world, estimate in the estimate's own world, so it contains the camera's drift
// and depends on the distance to the world's origin. `body` (VDO-SLAM, DynOSAM RME): H_body.

#include "sextant/geometry/se3.h"

namespace sextant {

struct PoseChangeError {
  double Et_m = 0;
  double ER_deg = 0;
};

PoseChangeError pose_change_error(const SE3& estimate, const SE3& truth);

}  // namespace sextant
