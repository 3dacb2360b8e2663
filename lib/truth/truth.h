#pragma once

// Ground truth of a sequence. Only metrics, noise checks, data sets and the experiment code that joins
// estimates with truth may include this header; estimators never see it (scripts/maintain/check_layers.py
// enforces this).

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

class SequenceTruth {
 public:
  Trajectory camera;                                ///< T_world_camera
  std::map<int, std::vector<ObjectTruth>> objects;  ///< by frame number, ordered by id
  /// RMS error of the lengths of the camera's true steps (m), if the data set allows to compute it. A
  /// measured accuracy of the camera cannot be better than this value.
  std::optional<double> camera_step_floor_m;

  /// Returns the object with this id in the frame; null if there is none.
  const ObjectTruth* find(int frame, int id) const {
    const auto it = objects.find(frame);
    if (it == objects.end()) return nullptr;
    for (const ObjectTruth& object : it->second) {
      if (object.id == id) return &object;
    }
    return nullptr;
  }

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
