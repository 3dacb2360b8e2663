#pragma once

// Explanations of most of a trajectory's error by a single constant: a lever arm, a rotation of the world
// about its vertical axis, axes of another convention, quaternions in another order. Each candidate is
// applied and the paths are aligned again as requested; the remaining error decides:
//
//   code       remedy              warned when
//   lever_arm  --body-from-camera  a constant vector in the body, estimated from relative motions, explains
//                                  more than half of the squared position errors; it is 5 cm .. 100 m long. A
//                                  vector longer than a tenth of the path's extent must explain four fifths
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
//   alignment  --align             with none or origin: se3, sim3 or yaw leaves less than a tenth of the RMSE
//
// "yaw" is distinct from drift: a path that turns away slowly keeps its rotation errors. Shifts of the clock
// or of the frame numbers are explained in trajectory_offset.h.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/pose_frames.h"
#include "sextant/eval/evaluation/trajectory_warnings.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Alignment of the paths; the members are the arguments of align().
struct AlignmentChoice {
  Alignment alignment = Alignment::none;
  int n_to_align = 0;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< needed for Alignment::yaw only
};

/// An explanation needs this many poses.
inline constexpr size_t fewest_explained_poses = 10;
/// Share of the sum of squared errors that an explanation may leave.
inline constexpr double largest_left_share = 0.5;

/// Differences between two paths.
struct Agreement {
  size_t n = 0;          ///< number of compared poses, which thinned() may have reduced
  double squares = 0;    ///< sum of squared distances, m^2
  double angle_deg = 0;  ///< mean angle between rotations

  double mean_squares_m2() const { return squares / static_cast<double>(n); }
};

/// Takes every k-th of the `n` poses from pose `first` on, at most 1000, which suffice for one constant. The
/// other poses are never copied, since a trajectory may take most of the memory.
PoseSeries thinned(const PoseSeries& series, size_t first, size_t n);
/// Overload for all poses.
PoseSeries thinned(const PoseSeries& series);

/// Returns true for an alignment that rotates the world about any axis.
bool turns_world(Alignment alignment);

/// Returns the agreement of the thinned paths after the alignment; empty if the poses do not determine it.
std::optional<Agreement> aligned_agreement(const PoseSeries& reference, const PoseSeries& estimate,
                                           const AlignmentChoice& choice);

/// Warns of the explanations of the table, except `alignment`. Both series are matched and not yet aligned;
/// the frames have already been applied.
std::vector<TrajectoryWarning> warnings_of_explanations(const PoseSeries& reference,
                                                        const PoseSeries& estimate,
                                                        const AlignmentChoice& choice, const PoseFrame& frame,
                                                        const PoseFrame& reference_frame = {});

/// Warns if the requested alignment leaves more than ten times the RMSE of another one.
std::optional<TrajectoryWarning> warning_of_alignment_kind(const PoseSeries& reference,
                                                           const PoseSeries& estimate,
                                                           const AlignmentChoice& choice);

}  // namespace sextant
