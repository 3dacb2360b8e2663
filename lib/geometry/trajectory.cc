#include "sextant/geometry/trajectory.h"

namespace sextant {

std::optional<SE3> Trajectory::pose(int frame) const {
  const auto it = poses_.find(frame);
  if (it == poses_.end()) return std::nullopt;
  return it->second;
}

std::optional<SE3> Trajectory::motion(int prev, int curr) const {
  const std::optional<SE3> T_world_prev = pose(prev);
  const std::optional<SE3> T_world_curr = pose(curr);
  if (!T_world_prev || !T_world_curr) return std::nullopt;
  return T_world_prev->inverse() * *T_world_curr;
}

}  // namespace sextant
