#pragma once

// Matches the poses of an estimate with the poses of a reference trajectory:
//
//   by time    if both have time stamps: the nearest stamp within a largest difference (lib/metrics/
//              trajectory_alignment.h), or the reference interpolated at the estimate's stamps
//   by frame   otherwise, if one of them has frame numbers; rows are the frame numbers of the other one. If
//              that one has time stamps, their gaps and number must agree with this
//   by row     otherwise; both must have the same number of poses

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Returns the frame numbers of a series, or its row numbers from 0 if it has none.
std::vector<int> frames_of(const PoseSeries& series);
/// Returns the time stamps (s) of a series, or frames_of() if it has none.
std::vector<double> times_of(const PoseSeries& series);

/// Statistics of the interpolation of the reference.
struct Interpolation {
  double largest_gap_s = 0;                    ///< longest gap of the reference that was interpolated
  size_t n_outside = 0, n_in_longer_gaps = 0;  ///< poses of the estimate that were left out
};

/// The poses of both sides that match.
struct MatchedPoses : TrajectoryPair {
  /// Row of each pose in the given reference; the nearest row if the reference was interpolated
  std::vector<int> reference_rows;
  std::optional<Interpolation> interpolation;  ///< if the reference was interpolated
};

/// Matches the poses; `interpolate_max_gap_s` interpolates the reference over gaps up to this. `name` names
/// the estimate in messages. Throws Error if the series have neither time stamps, frame numbers nor numbers
/// of poses in common, if rows with time stamps are not the frames of the other side, or if an option needs
/// time stamps that are missing.
MatchedPoses match_poses(const PoseSeries& reference, PoseSeries estimate, const AssociationOptions& options,
                         std::optional<double> interpolate_max_gap_s, const std::string& name);

/// Parts of both trajectories that --t-start and --t-end select: all poses without these flags.
struct EvaluatedRange {
  size_t n_reference = 0, n_estimate = 0;  ///< numbers of poses
  double duration = 0;                     ///< duration of the reference, in the units of times_of()

  size_t shorter() const { return std::min(n_reference, n_estimate); }
};

/// Returns the evaluated range. An estimate without time stamps is restricted to the frame numbers of the
/// selected poses of the reference.
EvaluatedRange evaluated_range(const PoseSeries& reference, const PoseSeries& estimate,
                               const AssociationOptions& options);

}  // namespace sextant
