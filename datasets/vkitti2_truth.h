#pragma once

// The ground truth and cameras of Virtual KITTI 2.0.3, from the text files of one scene and variation:
//
//   <folder>/{extrinsic,intrinsic,pose,bbox,info}.txt
//
// T_world_camera = inverse of the extrinsic of the chosen camera; per object id = trackID + 1,
// T_camera_object from the camera_space columns of pose.txt (middle of the bottom face, vkitti_box.h's
// rotation), size_m = (width, height, length), the box and isMoving of bbox.txt, type = label of info.txt.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/geometry/camera.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct Vkitti2Truth {
  SequenceTruth truth;
  std::optional<PinholeCamera> camera;  ///< of intrinsic.txt
  std::optional<double> baseline_m;     ///< between the two cameras, from extrinsic.txt
  std::vector<std::string> warnings;    ///< what is missing, one line each
};

/// Reads the files that are there, the others give warnings. Throws Error on a damaged file, no rows of
/// `camera`, intrinsics that change, objects in frames without extrinsics, and tracks that are missing in
/// bbox.txt or info.txt.
Vkitti2Truth read_vkitti2_truth(const std::filesystem::path& folder, int camera, InputLog& inputs);

}  // namespace sextant
