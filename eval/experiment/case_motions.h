#pragma once

// The motions of a case as its estimator gave them: the paths of camera and objects, for pictures, and their
// diagnosis.

#include <map>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/eval/diagnosis/motion_disagreement.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct CaseMotions {
  Trajectory estimated;          ///< T_world_camera; ends at the first frame without an ego estimate
  bool starts_at_truth = false;  ///< true: the first pose is the true one; false: the identity
  /// H_world of the estimate, by id and frame k of the pair (k-1, k).
  std::map<int, std::map<int, SE3>> objects;
};

/// Returns the paths (records/tracks.h): the camera's first, then those of objects with both an estimated
/// motion and truth, by id.
std::vector<BodyTrack> body_tracks(const CaseMotions& motions, const SequenceTruth& truth,
                                   const SequenceInfo& info);

// ---- Checks of the motions of a third-party estimator against the truth of its case, which detect
// centimetres, inverse motions, or another frame than the declared one (eval/diagnosis). The estimator never
// sees the truth or these messages.

/// Returns one line for each diagnosis, beginning with `estimator`. `recorded_camera`: the recorded poses
/// from which the camera's motions were computed, or null; another order of quaternion components can be
/// detected in poses only. Motions of objects are checked as they were logged: in the frame `declared` and in
/// the world of the recorded camera. They are checked only if nothing is found for the camera. `quaternions`:
/// false if the camera was recorded as matrices, which another order of components does not explain.
std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator,
                                       const Trajectory* recorded_camera = nullptr,
                                       MotionFrame declared = MotionFrame::world, bool quaternions = true);

}  // namespace sextant
