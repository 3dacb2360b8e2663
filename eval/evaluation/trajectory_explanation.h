#pragma once

// What one constant would explain most of an error: a lever arm, a turn of the world about its vertical, axes
// of another convention, quaternions read in another order. Each candidate is applied, the paths are aligned
// again as asked for, and what is left decides:
//
//   code       remedy              warned when
//   lever_arm  --body-from-camera  a constant vector in the body, found from relative motions, explains more than
//                                  half of the squared position errors; 5 cm .. 100 m, beyond a tenth of the
//                                  extent of the path four fifths
//   yaw        --align yaw         with --align none or scale: one turn explains more than half of the squared
//                                  errors that a shift leaves, and halves the mean rotation error; beyond 3 deg
//   inverse, axes, columns, transposed, unit, steps, body, world    another reading of one side leaves a fifth of
//                                  the squared error (eval/diagnosis), relative to the extent of the path and in
//                                  rad, and at most 5 %; what is left below 3 % as declared is not questioned.
//                                  Tried after the alignment asked for, then after se3 and sim3
//   alignment  --align             with none or origin: se3, sim3 or yaw leaves less than a tenth of the RMSE
//   lag        a shift of the clock explains more than half of the squared position errors, and the      --offset
//              motions alone say so too: 0 is not in the interval of estimate_offset()
//
// "yaw" alone is no drift: a path that turns away slowly keeps its rotation errors. "lag" is also what
// estimate_lag() finds, of a step and more, whatever it explains.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/pose_frames.h"
#include "sextant/eval/evaluation/trajectory_warnings.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// How the paths are aligned, as align() takes it.
struct AlignmentChoice {
  Alignment alignment = Alignment::none;
  int n_to_align = 0;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< may be 0 but for yaw
};

/// l with T_world_camera = T_world_body [I | l] in matched paths of the camera (reference) and of the body
/// (estimate), from their motions over k poses and up to one scale s of the estimate, in least squares:
///
///   t_reference,ij = s t_estimate,ij + (R_estimate,ij - I) l          j = i + k
///
/// with the smallest k for which the turns are 0.2 rad RMS, at most a quarter of the path. A direction that
/// the turns hardly determine (below 3 % of the best one's information), as the axis of a car's turns, is 0.
/// Empty when there are no turns.
std::optional<Eigen::Vector3d> estimate_lever_arm(const PoseSeries& reference, const PoseSeries& estimate);

/// The whole reference, and the matched estimate with its own stamps; `offset_s`: what is added to them already.
std::optional<TrajectoryWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                                  double offset_s, const AlignmentChoice& choice);

/// Both matched and not yet aligned; `frame`: what has already been applied to the estimate.
std::vector<TrajectoryWarning> warnings_of_explanations(const PoseSeries& reference,
                                                        const PoseSeries& estimate,
                                                        const AlignmentChoice& choice,
                                                        const PoseFrame& frame,
                                                        const PoseFrame& reference_frame = {});

/// A shift of 1 to 3 rows of the matched poses that leaves a fifth of the squared errors, of path or of steps.
/// `remedy`: what to do, for the number of frames to add to the estimate's.
std::optional<TrajectoryWarning> warning_of_rows_shifted(const PoseSeries& reference, const PoseSeries& estimate,
                                                         const AlignmentChoice& choice,
                                                         const std::function<std::string(int frames)>& remedy);

/// What other alignments would leave, where the one asked for is off by more than ten times.
std::optional<TrajectoryWarning> warning_of_alignment_kind(const PoseSeries& reference, const PoseSeries& estimate,
                                                           const AlignmentChoice& choice);

}  // namespace sextant
