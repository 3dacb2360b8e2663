#include "sextant/metrics/pose_change.h"

#include <numbers>

namespace sextant {

PoseChangeError pose_change_error(const SE3& estimate, const SE3& truth) {
  const SE3 error = estimate.inverse() * truth;
  return {error.translation().norm(), rotation_angle_rad(error.rotation()) * 180.0 / std::numbers::pi};
}

}  // namespace sextant
