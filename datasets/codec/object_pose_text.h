#pragma once

// Poses of objects as text, an extension of ours to the KITTI layout (training/object_pose/%04d.txt), for
// what label_02 has no column: roll and pitch. Per line
//
//   frame track_id  r11 r12 r13 x  r21 r22 r23 y  r31 r32 r33 z  [0 0 0 1]
//
// the matrix of T_camera_object row by row (m), in the coordinates of label_02: rectified camera 0, the
// middle of the box's bottom face, axes x right, y down, z ahead. Lines that start with '#' are comments.

#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "sextant/geometry/se3.h"

namespace sextant {

/// By frame and track id. Throws Error "NAME:LINE: ..." on another number of values, negative numbers of
/// frames or tracks, values that are not finite, what is no rotation, a track given twice in one frame.
std::map<std::pair<int, int>, SE3> decode_object_poses(std::string_view text, const std::string& name);

/// 17 significant digits: reads back as the same poses. Begins with a comment that explains the columns.
std::string encode_object_poses(const std::map<std::pair<int, int>, SE3>& poses);

}  // namespace sextant
