#pragma once

// Explanations of most of a trajectory's error by a single constant: a lever arm, a rotation of the world
// about its vertical axis, axes of another convention, quaternions in another order. Each candidate is
// applied and the paths are aligned again as requested; the remaining error decides:
//
//   code       remedy              warned when
//   lever_arm  --body-from-camera  a constant vector in the body, estimated from relative motions, explains
//                                  more than half of the squared position errors; it is 5 cm .. 100 m long. A
//                                  vector longer than a tenth of the path's extent must explain four fifths,
//                                  and leave at most half of what a change of scale leaves
//   body       --body-from-camera  a constant rotation of the body by 0.5 deg or more explains more than half
//                                  of the squared errors of relative translations (body_offset.h); not tried
//                                  beside a lever arm
//   yaw        --align yaw         with --align none or scale: one rotation explains more than half of the
//                                  squared errors that a translation leaves, and halves the mean rotation
//                                  error; above 3 deg
//   inverse, axes, columns, transposed, mirrored, unit, degrees, angles, steps, body, world,
//   world_of_rotations
//                                  another reading of one side leaves at most a fifth of the squared error,
//                                  and at most 5 %. The squared error is (RMS position error / RMS extent of
//                                  the path)^2 + (mean rotation error in rad)^2. A declared reading below 3 %
//                                  is not questioned. Tried with the requested alignment, then with se3 and
//                                  sim3
//   alignment  --align             with none, origin, scale or yaw: se3, sim3 or yaw leaves less than a tenth
//                                  of the RMSE
//
// "yaw" is distinct from drift: a path that turns away slowly keeps its rotation errors. Shifts of the clock
// or of the frame numbers are explained in trajectory_offset.h.

#include <optional>
#include <vector>

#include "sextant/eval/evaluation/pose_frames.h"
#include "sextant/eval/evaluation/trajectory_agreement.h"
#include "sextant/eval/evaluation/trajectory_warnings.h"

namespace sextant {

/// An explanation needs this many poses.
inline constexpr size_t fewest_explained_poses = 10;
/// Share of the sum of squared errors that an explanation may leave.
inline constexpr double largest_left_share = 0.5;

/// Warns of the explanations of the table, except `alignment`. The pair is not yet aligned; the frames
/// have already been applied.
std::vector<DataWarning> warnings_of_explanations(const TrajectoryPair& pair, const AlignmentChoice& choice,
                                                  const PoseFrame& frame,
                                                  const PoseFrame& reference_frame = {});

/// Warns if the requested alignment leaves more than ten times the RMSE of another one.
std::optional<DataWarning> warning_of_alignment_kind(const TrajectoryPair& pair,
                                                     const AlignmentChoice& choice);

}  // namespace sextant
