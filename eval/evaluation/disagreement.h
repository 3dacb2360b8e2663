#pragma once

// Warnings of an estimate that does not resemble its truth, for mistakes that no other reading of the data
// explains. The factor of motions, and when it is reported: eval/diagnosis/motion_disagreement.h.
//
//   code             what, and when it is reported
//   unexplained      path of a camera: the best of the requested alignment, se3 and sim3 leaves an RMSE above
//                    0.3 of the RMS extent of the reference, if that is 0.5 m or more, and motions over
//                    pieces of the path disagree, too, which they do not where an odometry drifts
//   rotation_factor  rotations of a camera about each axis of its body, over steps that turn by 3 deg RMS;
//                    small: below 0.5 deg RMS about this axis
//   object_axes      axes of the poses of objects: turned by the same rotation against the true ones, by
//                    20 deg or more, within 10 deg RMS
//
// and the codes of disagreements_of() for the motions of objects.

#include <vector>

#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/trajectory_explanation.h"

namespace sextant {

/// Warnings of a matched, not yet aligned pair of trajectories.
std::vector<TrajectoryWarning> warnings_of_disagreement(const PoseSeries& reference,
                                                        const PoseSeries& estimate,
                                                        const AlignmentChoice& choice);

/// Diagnoses of a log whose objects have their truth (its own, or by take_truth()).
std::vector<LogDiagnosis> diagnose_disagreement(const ObjectLog& log);

}  // namespace sextant
