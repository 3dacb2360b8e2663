#pragma once

// The true camera trajectory of a SOURCE as a reference for recorded results.

#include <string>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_evaluation.h"

namespace sextant {

/// `options` as of `--options` and `--set`, e.g. {"kitti":{"truth":"rectified"}}. Poses have frame numbers,
/// and time stamps: those of the data set, else frame / rate. Throws Error when the source has no true poses.
/// `every_pose`: also poses of frames that the source does not have, as KITTI's GPS/IMU file where only some
/// images are there.
EgoReference source_reference(const std::string& source, const std::string& data_root, const Json& options,
                              bool every_pose = false);

}  // namespace sextant
