#pragma once

// Agreement of two matched paths, as they are or after an alignment, and warnings where they do not agree.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Alignment of the paths; the members are the arguments of align().
struct AlignmentChoice {
  Alignment alignment = Alignment::none;
  int n_to_align = 0;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< needed for Alignment::yaw only

  /// Returns another alignment, estimated from all poses.
  AlignmentChoice with(Alignment other) const { return {other, 0, up}; }
  /// Returns true if the world is rotated about any axis.
  bool turns_world() const { return alignment == Alignment::se3 || alignment == Alignment::sim3; }
  bool scales() const { return alignment == Alignment::sim3 || alignment == Alignment::scale; }
};

/// Differences between two paths.
struct Agreement {
  size_t n = 0;          ///< number of compared poses, which thinned() may have reduced
  double squares = 0;    ///< sum of squared distances, m^2
  double angle_deg = 0;  ///< mean angle between rotations

  double mean_squares_m2() const { return squares / static_cast<double>(n); }
  double rmse_m() const { return std::sqrt(mean_squares_m2()); }
};

/// Takes every k-th of the `n` poses from pose `first` on, at most 1000, which suffice for one constant. The
/// other poses are never copied, since a trajectory may take most of the memory.
PoseSeries thinned(const PoseSeries& series, size_t first, size_t n);
/// Overloads for all poses.
PoseSeries thinned(const PoseSeries& series);
TrajectoryPair thinned(const TrajectoryPair& pair);

/// Calls use(reference, estimate) with the relative poses over `k` poses, from every `every`-th pose on.
template <typename Use>
void for_each_step(const TrajectoryPair& pair, size_t k, size_t every, const Use& use) {
  for (size_t i = 0; i + k < pair.size(); i += every)
    use(relative_pose(pair.reference, i, i + k), relative_pose(pair.estimate, i, i + k));
}
/// Overload for pieces of a hundredth of the path.
template <typename Use>
void for_each_piece(const TrajectoryPair& pair, const Use& use) {
  const size_t k = std::max<size_t>(1, pair.size() / 100);
  for_each_step(pair, k, k, use);
}

/// Compares two matched paths as they are.
Agreement agreement(const TrajectoryPair& pair);

/// Turns the estimate about the principal axis of the reference's path, such that the sum of squared chordal
/// distances of the rotations is least.
void turn_about_path(TrajectoryPair& pair);

/// Returns the pair after the alignment; nullopt if the poses do not determine it. The turn about a path on a
/// line, which its positions do not determine, is that of turn_about_path().
std::optional<TrajectoryPair> aligned(TrajectoryPair pair, const AlignmentChoice& choice);

/// Returns the agreement of the thinned paths after the alignment; empty if the poses do not determine it.
std::optional<Agreement> aligned_agreement(const TrajectoryPair& pair, const AlignmentChoice& choice);

// ---- Warnings of an estimate that does not resemble its reference, for mistakes that no other reading of
// the trajectories explains (trajectory_explanation.h). The factor of motions, and when it is reported:
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

/// Returns these warnings. The pair is not yet aligned.
std::vector<DataWarning> warnings_of_disagreement(const TrajectoryPair& pair, const AlignmentChoice& choice);

}  // namespace sextant
