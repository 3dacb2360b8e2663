#pragma once

// Layout `kitti`: writes a sequence as KITTI tracking has them, below OUT/training, with MOTS masks and,
// beside what that data set has, depth_02 and flow_02 (kitti_tracking.h). Channels that the source lacks are
// left out.
//
// Frames are numbered from 0, whatever their numbers in the source: a line of oxts has no number. The
// calibration has R_rect = I and camera 2 = camera 0, so that both choices of ground_truth mean the same
// poses.
//
// What the format does not keep:
//   - the world frame: poses come back relative to the first one
//   - roll and pitch of objects: rotation_y is the heading of their z axis; an object that is tilted by e
//     against the camera's vertical comes back turned by at most about e (position is exact)
//   - depth beyond 255.99 m and steps finer than 1/256 m; flow beyond 512 px and steps finer than 1/64 px
//   - rates other than 10 Hz: an Error

#include "sextant/datasets/layout.h"

namespace sextant {

struct KittiLayoutOptions {
  SEXTANT_OPTIONS(
      (double, oxts_jitter_ms, 0, "ms",
       "standard deviation of the GPS/IMU sample's time against the image (KITTI: about 5)"),
      (uint64_t, seed, 1, "", "of the jitter"))
  void check() const;
};

/// As layout.h says. Also throws Error on a frame without camera pose when others have one, an object without
/// box or size, or ids that MOTS cannot hold.
std::string write_kitti_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
