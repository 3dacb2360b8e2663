#pragma once

// The ground truth files of VDO-SLAM folders (vdo_folder.h).

#include <string>
#include <string_view>

#include "sextant/truth/truth.h"

namespace sextant {

using ObjectTruths = std::map<int, std::vector<ObjectTruth>>;

/// object_pose.txt: "frame id l t r b x y z ry" per line. Result by frame, ordered by id, `interpolated` set.
/// Throws Error "NAME:LINE: ..." on another number of values or an object given twice in one frame.
ObjectTruths decode_vdo_objects(std::string_view text, const std::string& name);

/// Sets `interpolated` where an object's position steps from and to its neighbour frames are equal:
/// |p(k+1) - 2 p(k) + p(k-1)| <= 1e-6 max(1, |p(k)|), which annotators' linear interpolation gives and real
/// motion does not.
void mark_interpolated(ObjectTruths& objects);

}  // namespace sextant
