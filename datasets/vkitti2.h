#pragma once

// Virtual KITTI 2.0.3: its ground truth, and the adapter `vkitti2`.
//
// The ground truth and cameras of Virtual KITTI 2.0.3 come from the text files of one scene and variation:
//
//   <folder>/{extrinsic,intrinsic,pose,bbox,info}.txt
//
// T_world_camera = inverse of the extrinsic of the chosen camera. For each object with id = trackID + 1:
// T_camera_object from the camera_space columns of pose.txt (origin in the middle of the bottom face,
// rotation as in vkitti_text.h); size_m = (width, height, length); the box and isMoving of bbox.txt; type =
// label of info.txt.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/datasets/folder_sequence.h"
#include "sextant/geometry/camera.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct Vkitti2Truth {
  SequenceTruth truth;
  std::optional<PinholeCamera> camera;  ///< from intrinsic.txt
  std::optional<double> baseline_m;     ///< between the two cameras, from extrinsic.txt
  std::vector<std::string> warnings;    ///< missing data, one line each
};

/// Reads the existing files; missing ones are warnings. Throws Error on a damaged file, a missing `camera`,
/// two cameras that are not a rectified pair with a constant baseline, intrinsics that change, objects in
/// frames without extrinsics, and tracks that are missing in bbox.txt or info.txt.
Vkitti2Truth read_vkitti2_truth(const std::filesystem::path& folder, int camera, InputLog& inputs);

// Adapter `vkitti2`: Virtual KITTI 2.0.3. SOURCE is vkitti2:ROOT#<scene>/<variation>[@first-last], such as
// vkitti2:ROOT#Scene18/clone; #0018/clone is equivalent, and #Scene18 means its clone.
// ROOT/<scene>/<variation> contains any subset of:
//
//   {extrinsic,intrinsic,pose,bbox,info}.txt                         see above
//   frames/rgb/Camera_{0,1}/rgb_%05d.jpg
//   frames/depth/Camera_{0,1}/depth_%05d.png                         16-bit, cm; 65535 = sky or too far
//   frames/forwardFlow/Camera_{0,1}/flow_%05d.png                    16-bit RGB (codec/dense_maps.h), to the
//   frames/backwardFlow/Camera_{0,1}/backwardFlow_%05d.png           next frame and to the one before
//   frames/instanceSegmentation/Camera_{0,1}/instancegt_%05d.png     trackID + 1, 0 = background
//
// An archive may also lie in a folder of its own name (vkitti_2.0.3_rgb/<scene>/...). Ids in masks and truth
// are track ids + 1. With text files only, there are poses and objects, and no channels. The left image is
// that of the chosen camera; camera 0 has camera 1 as its right one. The baseline is 0.532725 m, or that of
// extrinsic.txt, with a warning, if it differs by more than 2 mm. Source:
// europe.naverlabs.com/proxy-virtual-worlds-vkitti-2

struct Vkitti2Options : RatedChannelOptions {
  SEXTANT_OPTIONS_OF(RatedChannelOptions,
                     (int, camera, 0, "", "0 = left, with camera 1 as its right one; 1 = right camera only"))
  void check() const;
};

/// Throws Error on a scene, variation, file or frame range that is missing, or a file that is not as
/// described.
std::unique_ptr<Sequence> open_vkitti2(const SourceSpec& source);

}  // namespace sextant
