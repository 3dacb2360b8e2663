#pragma once

// Warnings of an estimate that does not resemble its reference, for mistakes that no other reading of the
// trajectories explains (trajectory_explanation.h). The factor of motions, and when it is reported:
// eval/diagnosis/motion_disagreement.h.
//
//   code             what, and when it is reported
//   constant         one coordinate is the same in all poses of the estimate, and the motion of the reference
//                    along it explains four fifths of the squared position errors; the RMSE exceeds 1 % of
//                    the RMS extent of the reference. Nothing else is reported then
//   unexplained      the best of the requested alignment, scale, se3 and sim3 leaves an RMSE above 0.3
//                    of the RMS extent of the reference, if that is 0.5 m or more, and motions over pieces
//                    of the path disagree, too, which they do not where an odometry drifts
//   large_rotations  over pieces of the path the estimate turns by 10 deg or more in the median, and twice as
//                    much as the reference or more
//   rotation_factor  rotations about each axis of the body, over steps that turn by 3 deg RMS; small: below
//                    0.5 deg RMS about this axis

#include <vector>

#include "sextant/eval/evaluation/trajectory_agreement.h"

namespace sextant {

/// Warns of these. The pair is not yet aligned.
std::vector<DataWarning> warnings_of_disagreement(const TrajectoryPair& pair, const AlignmentChoice& choice);

}  // namespace sextant
