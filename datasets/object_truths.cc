#include "sextant/datasets/object_truths.h"

#include <algorithm>

namespace sextant {
namespace {

const ObjectTruth* find(const ObjectTruths& objects, int frame, int id) {
  const auto it = objects.find(frame);
  if (it == objects.end()) return nullptr;
  const auto found = std::ranges::find(it->second, id, &ObjectTruth::id);
  return found == it->second.end() ? nullptr : &*found;
}

}  // namespace

void mark_interpolated(ObjectTruths& objects) {
  for (auto& [frame, list] : objects) {
    for (ObjectTruth& object : list) {
      const ObjectTruth* before = find(objects, frame - 1, object.id);
      const ObjectTruth* after = find(objects, frame + 1, object.id);
      if (before == nullptr || after == nullptr) continue;
      const Eigen::Vector3d& p = object.T_camera_object.translation();
      const Eigen::Vector3d step_in = p - before->T_camera_object.translation();
      const Eigen::Vector3d step_out = after->T_camera_object.translation() - p;
      object.interpolated = (step_out - step_in).norm() <= 1e-6 * std::max(1.0, p.norm());
    }
  }
}

std::map<int, std::vector<LabelBox>> label_boxes(const ObjectTruths& objects) {
  std::map<int, std::vector<LabelBox>> boxes;
  for (const auto& [frame, row] : objects) {
    for (const ObjectTruth& object : row) {
      if (object.box)
        boxes[frame].push_back({object.id, *object.box, object.T_camera_object.translation().z()});
    }
  }
  return boxes;
}

}  // namespace sextant
