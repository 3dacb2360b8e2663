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

/// Form in which an external system recorded its results. Another order of quaternion components is no
/// explanation of results that were recorded as matrices.
struct RecordedForm {
  const Trajectory* camera =
      nullptr;  ///< T_world_camera in its own world frame; null: only motions are known
  bool camera_has_quaternions = true;
  MotionFrame declared = MotionFrame::world;  ///< frame of the motions of objects
  bool motions_have_quaternions = true;
};

/// Returns one line for each diagnosis, beginning with `estimator`. Another order of quaternion components of
/// the camera can be detected in recorded poses only. Motions of objects are checked as they were logged: in
/// the declared frame and in the world of the recorded camera. They are checked only if nothing is found for
/// the camera.
std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator, const RecordedForm& recorded = {});

}  // namespace sextant
