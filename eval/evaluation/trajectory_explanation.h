#pragma once

// What one constant would explain most of an error: a lever arm, a turn of the world about its vertical, axes
// of another convention, quaternions read in another order. Each candidate is applied, the paths are aligned
// again as asked for, and what is left decides:
//
//   code       remedy              warned when
//   lever_arm  --body-from-camera  a constant vector in the body, found from relative motions, explains more than
//                                  half of the squared position errors; 5 cm .. 100 m
//   yaw        --align yaw         with --align none or scale: one turn explains more than half of the squared
//                                  errors that a shift leaves, and halves the mean rotation error; beyond 3 deg
//   axes       --axes, --ref-axes  axes of lib/geometry/axes.h take 90 % of the squared position errors away, or
//                                  the mean rotation error from above 30 deg to less than a quarter
//   columns    a header, --format  the quaternions of one side read with w at the other end do the latter
//
//   lag        a shift of the clock explains more than half of the squared position errors, and the      --offset
//              motions alone say so too: 0 is not in the interval of estimate_offset()
//
// "yaw" alone is no drift: a path that turns away slowly keeps its rotation errors. "lag" is also what
// estimate_lag() finds, of a step and more, whatever it explains.

#include <optional>
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
                                                        const PoseFrame& frame);

}  // namespace sextant
