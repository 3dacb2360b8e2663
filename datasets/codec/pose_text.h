#pragma once

// Poses as text: per line a frame number and 16 values, the 4x4 matrix of a rigid transform row by row
// (m). VDO-SLAM folders: camera -> world.

#include <map>
#include <string>
#include <string_view>

#include "sextant/datasets/codec/text_rows.h"
#include "sextant/geometry/se3.h"

namespace sextant {

/// By frame number. Throws Error "NAME:LINE: ..." on another number of values, values that are not finite,
/// a last row other than 0 0 0 1, a rotation that is off orthonormal by more than 1e-3, a frame given twice.
std::map<int, SE3> decode_pose_text(std::string_view text, const std::string& name);

/// The 4x4 matrix in fields `first` .. `first + 15` of a row, checked as above; its first three rows where
/// the fields end there.
SE3 read_pose_fields(const TextRows& rows, size_t first);

/// 17 significant digits: reads back as the same poses.
std::string encode_pose_text(const std::map<int, SE3>& poses);

}  // namespace sextant
