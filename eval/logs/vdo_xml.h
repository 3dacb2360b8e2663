#pragma once

// The log of VDO-SLAM's front end: boost serialisation of its frames as XML,
//
//   <item><pose><R_><rot11>..<rot33></R_><t_><data><item>x</item>..</data></t_></pose><gt_pose>...</gt_pose>
//         <timestamp>s</timestamp><frame_id>n</frame_id> ...</item>
//
// `pose` and `gt_pose` are T_world_camera (m). Its time stamps hold 0.05 s steps for KITTI's 0.1 s, so the
// frame number counts.

#include <string>

#include "sextant/eval/logs/pose_collector.h"

namespace sextant {

/// Throws Error "PATH:LINE: ..." on anything else.
void read_vdo_frontend_xml(const std::string& path, const FileKind& kind, PoseSeries& estimate,
                           PoseSeries& truth, RepairLog& log);

}  // namespace sextant
