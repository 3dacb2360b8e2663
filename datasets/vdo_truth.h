#pragma once

// The ground truth files of VDO-SLAM folders (vdo_folder.h).

#include <string>
#include <string_view>

#include "sextant/datasets/object_truths.h"

namespace sextant {

/// object_pose.txt: "frame id l t r b x y z ry" per line. Result by frame, ordered by id, `interpolated` set.
/// Throws Error "NAME:LINE: ..." on another number of values or an object given twice in one frame.
ObjectTruths decode_vdo_objects(std::string_view text, const std::string& name);

}  // namespace sextant
