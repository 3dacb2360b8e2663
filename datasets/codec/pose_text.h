#pragma once

// Poses as text: per line a frame number and 16 values, the 4x4 matrix of a rigid transform row by row
// (m). VDO-SLAM folders: camera -> world.

#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "sextant/datasets/codec/text_rows.h"
#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"

namespace sextant {

/// Decodes poses by frame number. Throws Error "NAME:LINE: ..." on another number of values, values that are
/// not finite, a last row other than 0 0 0 1, a rotation that differs from orthonormal by more than 1e-3 or
/// is a reflection, and a repeated frame.
std::map<int, SE3> decode_pose_text(std::string_view text, const std::string& name);

/// Returns the pose whose 4x4 matrix is in fields `first` .. `first + 15` of a row, with the checks of
/// decode_pose_text(); the last row of the matrix may be missing at the end of the fields.
SE3 read_pose_fields(const TextRows& rows, size_t first);

/// Encodes the matrices with 17 significant digits, so that the poses read back are equal up to rounding.
std::string encode_pose_text(const std::map<int, SE3>& poses);

// Poses of objects as text, an extension of the KITTI layout by this project (training/object_pose/%04d.txt)
// for roll and pitch, which label_02 does not contain. Per line
//
//   frame track_id  r11 r12 r13 x  r21 r22 r23 y  r31 r32 r33 z  [0 0 0 1]
//
// the matrix of T_camera_object row by row (m), in the coordinates of label_02: rectified camera 0, the
// middle of the box's bottom face, axes x right, y down, z ahead. Lines that start with '#' are comments.

/// Decodes poses by frame and track id. Throws Error "NAME:LINE: ..." on another number of values, negative
/// frame or track numbers, values that are not finite, a matrix that is not a rotation, and a track that is
/// repeated in a frame.
std::map<std::pair<int, int>, SE3> decode_object_poses(std::string_view text, const std::string& name);

/// Encodes the matrices with 17 significant digits, so that the poses read back are equal up to rounding. The
/// first lines are comments that explain the columns.
std::string encode_object_poses(const std::map<std::pair<int, int>, SE3>& poses);

// Stereo cameras in OpenCV YAML, in the format of ORB-SLAM2 and VDO-SLAM: "%YAML:1.0" and the keys Camera.fx,
// Camera.fy, Camera.cx, Camera.cy (px), Camera.bf (focal length times baseline, px m); optionally Camera.fps
// (Hz).

struct YamlCamera {
  StereoCamera camera;
  double rate_hz = 0;  ///< 0 = not given
  /// Coefficients Camera.k1, k2, p1, p2, k3 of the lens distortion that are not zero. The cameras of this
  /// project are pinhole cameras, so a reader must warn about them.
  std::map<std::string, double> distortion;
  std::optional<double> depth_map_factor;  ///< DepthMapFactor, the factor of the integers in the depth files
};

/// Decodes a camera. Throws Error on a file without %YAML in its first line, and Error that names the missing
/// keys, a repeated key, or the key whose value is not a number from 1e-6 to 1e9.
YamlCamera decode_yaml_camera(std::string_view text, const std::string& name);

std::string encode_yaml_camera(const YamlCamera& camera);

}  // namespace sextant
