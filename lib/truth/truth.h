#pragma once

// Ground truth of a sequence. Only metrics, data sets and the modules of eval that compare estimates with
// truth may include this header; estimators and noise never see it (scripts/maintain/check_layers.py enforces
// this).

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/geometry/trajectory.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// Object axes: x right, y down, z ahead; origin in the middle of the box's bottom face.
struct ObjectTruth {
  int id = 0;                             ///< id in the source's masks (KITTI track id + 1)
  SE3 T_camera_object;                    ///< object pose in the camera frame at the same time
  std::optional<ImageBox> box;            ///< box in the image, px
  std::optional<bool> moving;             ///< the data set's own dynamic/static flag, if it has one
  bool interpolated = false;              ///< the pose was interpolated between labelled frames
  std::optional<Eigen::Vector3d> size_m;  ///< width (x), height (y), length (z) of the box
  std::string type;                       ///< the data set's name of the class ("Car"); may be empty
};

/// Objects by frame number, ordered by id.
using ObjectTruths = std::map<int, std::vector<ObjectTruth>>;

/// Returns the object with this id in the frame; null if there is none.
inline const ObjectTruth* find_object(const ObjectTruths& objects, int frame, int id) {
  const auto it = objects.find(frame);
  if (it == objects.end()) return nullptr;
  const auto found = std::ranges::find(it->second, id, &ObjectTruth::id);
  return found == it->second.end() ? nullptr : &*found;
}

class SequenceTruth {
 public:
  Trajectory camera;  ///< T_world_camera
  ObjectTruths objects;
  /// RMS error of the lengths of the camera's true steps (m), if the data set allows to compute it. A
  /// measured accuracy of the camera cannot be better than this value.
  std::optional<double> camera_step_floor_m;

  const ObjectTruth* find(int frame, int id) const { return find_object(objects, frame, id); }

  /// Return T_curr_prev of one rigid body, which maps its points from previous to current camera coordinates;
  /// for the background this is the inverse of the camera's own motion. nullopt if the pose of the camera, or
  /// of the object, is missing in either frame.
  std::optional<SE3> background_motion(int prev, int curr) const {
    const std::optional<SE3> T_prev_curr = camera.motion(prev, curr);
    if (!T_prev_curr) return std::nullopt;
    return T_prev_curr->inverse();
  }
  std::optional<SE3> object_motion(int id, int prev, int curr) const {
    const ObjectTruth* before = find(prev, id);
    const ObjectTruth* after = find(curr, id);
    if (before == nullptr || after == nullptr) return std::nullopt;
    return after->T_camera_object * before->T_camera_object.inverse();
  }
};

}  // namespace sextant
