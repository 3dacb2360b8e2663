#pragma once

// The log of VDO-SLAM's front end: its frames in boost serialisation as XML,
//
//   <item><pose><R_><rot11>..<rot33></R_><t_><data><item>x</item>..</data></t_></pose><gt_pose>...</gt_pose>
//         <timestamp>s</timestamp><frame_id>n</frame_id> ...</item>
//
// `pose` and `gt_pose` are T_world_camera (m). The time stamps are ignored, because they have steps of 0.05 s
// where KITTI has 0.1 s; poses have frame numbers instead.

#include <string>

#include "sextant/eval/logs/pose_collector.h"

namespace sextant {

/// Appends the estimated and the true pose of every frame to `estimate` and `truth`. Throws Error "PATH:LINE:
/// ..." on any other content.
void read_vdo_frontend_xml(const std::string& path, const FileKind& kind, PoseSeries& estimate,
                           PoseSeries& truth, RepairLog& log);

}  // namespace sextant
