#pragma once

// The files of a run.

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/output.h"

namespace sextant {

/// records.jsonl, run.json and, per source, est_camera_{kitti,tum}.txt and obj_<id>_motion.txt; with more
/// than one source these lie in a subfolder each.
///   est_camera_kitti.txt  12 values a line: rows of [R|t] of T_world_camera
///   est_camera_tum.txt    t tx ty tz qx qy qz qw, t = frame / rate (s)
///   gt_camera_tum.txt     the same of the truth, over the frames of the source that have it
///   tracks.csv            camera and objects in the world, estimated and true (tracks.h)
///   obj_<id>_motion.txt   frame k, then 12 values of H_world of the pair (k-1, k) (m)
OutputFiles run_files(const RunResult& result);

/// build_provenance(), configuration and inputs of a run.
Json run_provenance(const RunResult& result);

}  // namespace sextant
