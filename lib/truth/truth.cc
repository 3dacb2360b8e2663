#include "sextant/truth/truth.h"

namespace sextant {

const ObjectTruth* SequenceTruth::find(int frame, int id) const {
  const auto it = objects.find(frame);
  if (it == objects.end()) return nullptr;
  for (const ObjectTruth& object : it->second) {
    if (object.id == id) return &object;
  }
  return nullptr;
}

std::optional<SE3> SequenceTruth::background_motion(int prev, int curr) const {
  const std::optional<SE3> T_prev_curr = camera.motion(prev, curr);
  if (!T_prev_curr) return std::nullopt;
  return T_prev_curr->inverse();
}

std::optional<SE3> SequenceTruth::object_motion(int id, int prev, int curr) const {
  const ObjectTruth* before = find(prev, id);
  const ObjectTruth* after = find(curr, id);
  if (before == nullptr || after == nullptr) return std::nullopt;
  return after->T_camera_object * before->T_camera_object.inverse();
}

}  // namespace sextant
