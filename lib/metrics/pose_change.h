#pragma once

// Pose change error of one step (paper sec. V):  E = Xhat^-1 X,  E_t = |trans(E)| (m),
// E_R = angle(E) (deg), the angle as 2 atan2(|q_v|, |q_w|) in double.
//
// Which X (geometry/object_motion.h): `camera`: T_curr_prev of the object; the ego motion: T_prev_curr.
// `world` (published code): H_world, estimate in the estimate's own world, so it contains the camera's drift
// and depends on the distance to the world's origin. `body` (VDO-SLAM, DynOSAM RME): H_body.

#include <cmath>
#include <numbers>

#include "sextant/geometry/se3.h"

namespace sextant {

struct PoseChangeError {
  double Et_m = 0;
  double ER_deg = 0;
};

inline PoseChangeError pose_change_error(const SE3& estimate, const SE3& truth) {
  const SE3 error = estimate.inverse() * truth;
  return {error.translation().norm(), rotation_angle_rad(error.rotation()) * 180.0 / std::numbers::pi};
}

/// E_v = |v_hat - v| of one object step, km/h. The speed v of a motion: geometry/object_motion.h. Two readings of the truth:
///   same_formula          the true H at the same centroid as the estimate;
///   origin_displacement   the true displacement of the label box's origin (published code)
inline double velocity_error_kmh(double estimate_kmh, double truth_kmh) {
  return std::abs(estimate_kmh - truth_kmh);
}

}  // namespace sextant
