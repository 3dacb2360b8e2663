#pragma once

// The truth of a SOURCE as a reference for recorded results. `options` as of `--options` and `--set`, e.g.
// {"source":{"truth":"rectified"}}.

#include <string>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Poses have frame numbers, and time stamps: those of the data set, else frame / rate. Throws Error when the
/// source has no true poses. `every_pose`: also poses of frames that the source does not have, as KITTI's GPS/IMU file where only some
/// images are there.
EgoReference source_reference(const std::string& source, const std::string& data_root, const Json& options,
                              bool every_pose = false);

/// The truth with the objects of the frames that SOURCE@first-last asks for. Throws Error when there are none.
SequenceTruth source_objects(const std::string& source, const std::string& data_root, const Json& options);

}  // namespace sextant
