#pragma once

// Layout `vdo`: writes a sequence as a VDO-SLAM folder (vdo_folder.h), OUT itself or OUT/<sequence> when a
// name is given:
//
//   image_0/%06d.png    RGB              depth/%06d.png      disparity * 256, z = bf / (n / 256)
//   flow/%06d.flo       to the next      semantic/%06d.txt   instance ids
//   camera.yaml         f, c, bf, fps    times.txt           line k: time of frame k, s (from frame 0 on)
//   pose_gt.txt         truth, where there is any; object_pose.txt likewise
//
// Frames keep their numbers. What the format does not keep: depth nearer than bf / 255.99 and steps of
// disparity finer than 1/256 px; of an object's rotation all but the heading of its z axis, and objects
// without a 2-D box have an empty one. Channels that the source lacks are left out.

#include <string>

#include "sextant/datasets/layout.h"

namespace sextant {

/// As layout.h says.
std::string write_vdo_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
