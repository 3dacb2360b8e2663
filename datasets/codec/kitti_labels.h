#pragma once

// Object labels of KITTI tracking (label_02/%04d.txt), 17 columns:
//
//   frame track_id type truncated occluded alpha
//   left top right bottom  height width length  x y z rotation_y
//
// Boxes in px; sizes and positions in m; (x, y, z) is the middle of the box's bottom face in rectified camera
// 0; angles in rad, rotation_y about the camera's y axis, 0 = drives along +x. Rows of type DontCare have
// track id -1 and no pose.

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/measurement/image_box.h"

namespace sextant {

struct KittiLabel {
  int frame = 0;
  int track_id = -1;
  std::string type;
  double truncated = 0;
  int occluded = 0;
  double alpha_rad = 0;
  ImageBox box;
  double height_m = 0, width_m = 0, length_m = 0;
  Eigen::Vector3d position_m{0, 0, 0};
  double rotation_y_rad = 0;

  bool dont_care() const { return type == "DontCare"; }
};

/// In order of the file. Throws Error "NAME:LINE: ..." on another number of columns, values that are not
/// finite, negative frames, ids or (except DontCare) sizes, and a track given twice in one frame.
std::vector<KittiLabel> decode_kitti_labels(std::string_view text, const std::string& name);

/// 17 significant digits for the pose; boxes and sizes to 1e-6.
std::string encode_kitti_labels(const std::vector<KittiLabel>& labels);

}  // namespace sextant
