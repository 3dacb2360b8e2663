#pragma once

// The text files of Virtual KITTI 2.0.3 (SceneXX/<variation>/*.txt), row by row.
//
//   extrinsic.txt  frame cameraID r1,1 .. t3 0 0 0 1: the 4x4 matrix world -> camera, m
//   intrinsic.txt  frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]: fx fy cx cy, px
//   pose.txt       3-D box of one object in one frame and camera, see Vkitti2Pose
//   bbox.txt       2-D box of the same, see Vkitti2Box
//   info.txt       trackID label model color
//   colors.txt     Category r g b: the colours of classSegmentation, written only
//
// Decoders accept CRLF, a byte order mark and empty lines, find columns by name, and throw Error "NAME:LINE:
// ..." on columns that are missing (with their names), rows of another length, values that are not finite,
// and on a row given twice (same frame, camera and track). Encoders write shortest digits that read back the
// same. Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-2, the data set's own README.

#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/codec/vkitti_box.h"
#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/image_box.h"

namespace sextant {

struct Vkitti2Extrinsic {
  int frame = 0;
  int camera = 0;  ///< 0 left, 1 right
  SE3 T_camera_world;
};

struct Vkitti2Intrinsic {
  int frame = 0;
  int camera = 0;
  PinholeCamera k;
};

/// One row of pose.txt; m, rad. Angles as in vkitti_box.h, of the camera's and of the world's axes.
struct Vkitti2Pose {
  int frame = 0;
  int camera = 0;
  int track = 0;
  double alpha = 0;                                     ///< camera_angles.ry - atan2(x, z) of camera_m
  Eigen::Vector3d size_m{0, 0, 0};                      ///< of the 3-D box: width, height, length
  Eigen::Vector3d world_m{0, 0, 0}, camera_m{0, 0, 0};  ///< middle of its bottom face in both coordinates
  VkittiAngles world_angles, camera_angles;
};

/// One row of bbox.txt; px.
struct Vkitti2Box {
  int frame = 0;
  int camera = 0;
  int track = 0;
  ImageBox box;
  int number_pixels = 0;        ///< that show the object
  double truncation_ratio = 0;  ///< 0 not truncated .. 1
  double occupancy_ratio = 0;   ///< share of the box that shows the object
  bool is_moving = false;       ///< from this frame to the next
};

struct Vkitti2Info {
  int track = 0;
  std::string label, model, color;  ///< "Car", "Sedan4Door", "Silver"
};

std::vector<Vkitti2Extrinsic> decode_vkitti2_extrinsics(std::string_view text, const std::string& name);
std::vector<Vkitti2Intrinsic> decode_vkitti2_intrinsics(std::string_view text, const std::string& name);
std::vector<Vkitti2Pose> decode_vkitti2_poses(std::string_view text, const std::string& name);
std::vector<Vkitti2Box> decode_vkitti2_boxes(std::string_view text, const std::string& name);
std::vector<Vkitti2Info> decode_vkitti2_infos(std::string_view text, const std::string& name);

std::string encode_vkitti2_extrinsics(const std::vector<Vkitti2Extrinsic>& rows);
std::string encode_vkitti2_intrinsics(const std::vector<Vkitti2Intrinsic>& rows);
std::string encode_vkitti2_poses(const std::vector<Vkitti2Pose>& rows);
std::string encode_vkitti2_boxes(const std::vector<Vkitti2Box>& rows);
std::string encode_vkitti2_infos(const std::vector<Vkitti2Info>& rows);
/// colors.txt: the categories and colours of the release.
std::string_view vkitti2_colors();

}  // namespace sextant
