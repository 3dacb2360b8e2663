#pragma once

// Recorded camera trajectories of other systems on KITTI tracking, as records: per frame pair the paper's
// pose change error against the truth.
//
//   ROOT/kitti_tracking                                     truth (text is enough)
//   ROOT/kitti_tracking_peers/orbslam3_camera/0003.txt      KITTI format
//   ROOT/kitti_tracking_peers/vdo_slam_frontend/0000.xml    VDO-SLAM's log
//
//   errors.Et_m, ER_deg        against the raw truth
//   errors.Et_corrected_m      against the truth with velocity-corrected step lengths
//   errors.Et_scaled_m         raw truth, the estimate scaled to the truth's size (Umeyama, scale only)
//   values.step_gt_m, step_floor_m

#include <string>
#include <vector>

#include "sextant/eval/records/output.h"

namespace sextant {

/// The paper's sequences of which text truth is known to be public: "0000" .. "0020".
const std::vector<std::string>& recorded_sequences();

/// Files that evaluate_recorded() would read, as path -> SHA-256.
Json recorded_inputs(const std::string& data_root);

/// records.jsonl, run.json, and per system and sequence <system>_<sequence>_{reference,estimate}.tum.
OutputFiles evaluate_recorded(const std::string& data_root);

}  // namespace sextant
