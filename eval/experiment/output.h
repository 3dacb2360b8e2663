#pragma once

// The files of a run, and an output folder that is either complete or not there.

#include <filesystem>
#include <map>
#include <string>

#include "sextant/eval/experiment/run.h"

namespace sextant {

/// Path relative to the output folder -> bytes.
using OutputFiles = std::map<std::string, std::string>;

/// records.jsonl, run.json and, per source, est_camera_{kitti,tum}.txt and obj_<id>_motion.txt; with more
/// than one source these lie in a subfolder each.
///   est_camera_kitti.txt  12 values a line: rows of [R|t] of T_world_camera
///   est_camera_tum.txt    t tx ty tz qx qy qz qw, t = frame / rate (s)
///   gt_camera_tum.txt     the same of the truth, over the frames of the source that have it
///   tracks.csv            camera and objects in the world, estimated and true (tracks.h)
///   obj_<id>_motion.txt   frame k, then 12 values of H_world of the pair (k-1, k) (m)
OutputFiles run_files(const RunResult& result);

/// Version, build and machine: what every run.json begins with.
Json build_provenance();
/// build_provenance(), configuration and inputs of a run.
Json run_provenance(const RunResult& result);

/// Throws Error when `folder` cannot take the results of `configuration` (resolved_configuration()): it is a
/// file, or it holds the records of another configuration and `force` is off. A run may be repeated in place.
void check_output_folder(const std::filesystem::path& folder, const Json& configuration, bool force);

/// Creates the folder where needed, writes every file into a subfolder of it and moves them into place when
/// all are there. When anything fails (or Ctrl-C comes) before, removes what it has written and created:
/// earlier results are as they were. Rethrows.
void write_output_folder(const std::filesystem::path& folder, const OutputFiles& files);

}  // namespace sextant
