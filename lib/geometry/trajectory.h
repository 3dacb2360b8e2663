#pragma once

// Camera poses by frame number. A frame without a pose has none: never an identity in its place.

#include <map>
#include <optional>

#include "sextant/geometry/se3.h"

namespace sextant {

class Trajectory {
 public:
  void set(int frame, const SE3& T_world_camera) { poses_[frame] = T_world_camera; }
  bool has(int frame) const { return poses_.contains(frame); }
  std::optional<SE3> pose(int frame) const {
    return has(frame) ? std::optional(poses_.at(frame)) : std::nullopt;
  }

  /// T_prev_curr: the camera's own motion; empty when either pose is missing.
  std::optional<SE3> motion(int prev, int curr) const {
    if (!has(prev) || !has(curr)) return std::nullopt;
    return poses_.at(prev).inverse() * poses_.at(curr);
  }

  const std::map<int, SE3>& poses() const { return poses_; }
  bool empty() const { return poses_.empty(); }

 private:
  std::map<int, SE3> poses_;
};

}  // namespace sextant
