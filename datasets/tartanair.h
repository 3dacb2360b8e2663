#pragma once

// Adapter `tartanair`: TartanAir V2, the front cameras. SOURCE is tartanair:FOLDER[@first-last] with the
// folder of one trajectory, or tartanair:ROOT#ENV/Data_easy/P000[@first-last] with the folder that holds the
// environments. The folder of a trajectory has, as downloaded,
//
//   image_lcam_front/%06d_lcam_front.png         8-bit RGB, 640x640
//   image_rcam_front/%06d_rcam_front.png         the right camera
//   depth_lcam_front/%06d_lcam_front_depth.png   float32 in four channels (codec/dense_maps.h)
//   flow_lcam_front/%06d_%06d_flow.png           16-bit RGB (codec/dense_maps.h), to the next frame
//   pose_lcam_front.txt                          tx ty tz qx qy qz qw per line; line k + 1 is frame k
//
// Each of them may be missing, but not both the poses and the left images; with the poses only, there is
// camera truth and no channel. Poses are T_world_camera, with NED axes (x ahead, y right, z down) of world
// and camera; they are converted to `opencv` axes (geometry/axes.h). The scenes are static: there are no
// objects, and all mask pixels are background. seg_lcam_front contains classes, not instances, and is not
// read. Camera: f = 320 px, c = (320, 320), baseline 0.25 m, 10 Hz. Source: tartanair.org/modalities.html

#include <memory>

#include "sextant/datasets/folder_sequence.h"

namespace sextant {

inline constexpr int tartanair_size_px = 640;
inline constexpr double tartanair_focal_px = 320;
inline constexpr double tartanair_baseline_m = 0.25;

using TartanairOptions = RatedChannelOptions;

/// Throws Error on a folder, file or frame range that is missing, or a file that is not as described.
std::unique_ptr<Sequence> open_tartanair(const SourceSpec& source);

}  // namespace sextant
