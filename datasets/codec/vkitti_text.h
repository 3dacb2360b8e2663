#pragma once

// Text files of Virtual KITTI 1.3.1 and 2.0.3, and the orientation of their boxes.
//
// Orientation of the 3-D boxes of Virtual KITTI, equal in 1.3.1 and 2.0.3:
//
//   R_camera_object = Ry(ry + pi/2) Rx(rx) Rz(rz),   object axes x right, y down, z ahead (along the length).
//
// Evidence: with this rotation the boxes of worlds 0001, 0002, 0018 stand upright in the world (median tilt
// below 0.001 deg; without the offset before Rx and Rz they lean by 2.5 to 3.5 deg) and cars move along their
// z axis. Pose rows of 2.0.3 repeat the numbers of 1.3.1 (Scene18/clone, frame 25, track 0). See
// docs/datasets.md.

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// Smallest step to the next frame (m) of an object that is flagged as moving: 0.1 m/s at 10 Hz.
constexpr double moving_step_m = 0.01;

inline constexpr double vkitti_yaw_offset_rad = 1.57079632679489661923;

struct VkittiAngles {
  double ry = 0, rx = 0, rz = 0;  ///< rad
};

Eigen::Quaterniond vkitti_rotation(const VkittiAngles& angles);
/// Returns the angles of a rotation; |rx| <= pi/2, the others within [-pi, pi].
VkittiAngles vkitti_angles(const Eigen::Quaterniond& R_camera_object);

// The text files of Virtual KITTI 1.3.1, with one record per row. Each begins with a row that names the
// columns.
//
//   extrinsicsgt/<world>_<variation>.txt   frame r1,1 r1,2 r1,3 t1 r2,1 .. t3 0 0 0 1: the 4x4 matrix
//                                          world -> camera, m (some copies mangle the last four names)
//   motgt/<world>_<variation>.txt          one object in one frame per row, see Vkitti1Object
//   scenegt/<world>_<variation>_scenegt_rgb_encoding.txt   Category(:id) r g b: the colours of scenegt/*.png
//
// Decoders accept CRLF, a byte order mark and empty lines, find columns by name, and throw Error "NAME:LINE:
// ..." on missing columns (with their names), rows of another length, values that are not finite, and on
// repeated frames, objects of a frame, or colours of a track. Encoders write the fewest digits that read back
// the same. Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-1, the data set's own README.

/// One row of motgt. Camera coordinates; m, rad, px.
struct Vkitti1Object {
  int frame = 0;
  int tid = 0;                          ///< track id, unique in a world
  std::string label;                    ///< as in KITTI; "DontCare" for barely visible objects
  int truncated = 0;                    ///< 0, 1, 2: not, partly, heavily
  int occluded = 0;                     ///< 0, 1, 2
  double alpha = 0;                     ///< ry - atan2(x3d, z3d)
  ImageBox box;                         ///< l, t, r, b
  Eigen::Vector3d size_m{0, 0, 0};      ///< size of the 3-D box: w3d, h3d, l3d
  Eigen::Vector3d position_m{0, 0, 0};  ///< middle of its bottom face: x3d, y3d, z3d
  VkittiAngles angles;                  ///< ry, rx, rz
  double truncr = 0;                    ///< 0 not truncated .. 1
  double occupr = 0;                    ///< share of the 2-D box that shows the object
  std::string orig_label;               ///< "Car", "Van", "Truck"
  bool moving = false;                  ///< the value 0 is reliable in worlds 0001 and 0002 only
  std::string model, color;             ///< "Sedan4Door", "Silver"
};

/// One row of the colour table of scenegt images.
struct Vkitti1Color {
  std::string category;    ///< "Car", "Building"
  std::optional<int> tid;  ///< the number after ':'
  Rgb color;
};

/// Decode and encode T_camera_world by frame.
std::map<int, SE3> decode_vkitti1_extrinsics(std::string_view text, const std::string& name);
std::string encode_vkitti1_extrinsics(const std::map<int, SE3>& T_camera_world);

std::vector<Vkitti1Object> decode_vkitti1_objects(std::string_view text, const std::string& name);
std::string encode_vkitti1_objects(const std::vector<Vkitti1Object>& objects);

std::vector<Vkitti1Color> decode_vkitti1_colors(std::string_view text, const std::string& name);
std::string encode_vkitti1_colors(const std::vector<Vkitti1Color>& colors);

// The text files of Virtual KITTI 2.0.3 (SceneXX/<variation>/*.txt), row by row.
//
//   extrinsic.txt  frame cameraID r1,1 .. t3 0 0 0 1: the 4x4 matrix world -> camera, m
//   intrinsic.txt  frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]: fx fy cx cy, px
//   pose.txt       3-D box of one object in one frame and camera, see Vkitti2Pose
//   bbox.txt       2-D box of one object in one frame and camera, see Vkitti2Box
//   info.txt       trackID label model color
//   colors.txt     Category r g b: the colours of classSegmentation; written but not read
//
// Decoders accept CRLF, a byte order mark and empty lines, find columns by name, and throw Error "NAME:LINE:
// ..." on missing columns (with their names), rows of another length, values that are not finite, and on a
// repeated row (equal frame, camera and track). Encoders write the fewest digits that read back the same.
// Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-2, the data set's own README.

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

/// One row of pose.txt; m, rad. The angles are those defined above, in the axes of the camera and of the
/// world.
struct Vkitti2Pose {
  int frame = 0;
  int camera = 0;
  int track = 0;
  double alpha = 0;                 ///< camera_angles.ry - atan2(x, z) of camera_m
  Eigen::Vector3d size_m{0, 0, 0};  ///< size of the 3-D box: width, height, length
  /// middle of its bottom face in both coordinate frames
  Eigen::Vector3d world_m{0, 0, 0}, camera_m{0, 0, 0};
  VkittiAngles world_angles, camera_angles;
};

/// One row of bbox.txt; px.
struct Vkitti2Box {
  int frame = 0;
  int camera = 0;
  int track = 0;
  ImageBox box;
  int number_pixels = 0;        ///< number of pixels that show the object
  double truncation_ratio = 0;  ///< 0 not truncated .. 1
  double occupancy_ratio = 0;   ///< share of the box that shows the object
  bool is_moving = false;       ///< between this frame and the next
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
/// Returns colors.txt: the categories and colours of the release.
std::string_view vkitti2_colors();

}  // namespace sextant
