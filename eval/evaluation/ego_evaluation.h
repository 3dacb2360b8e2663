#pragma once

// Evaluates recorded camera trajectories, of one run or of several runs of several systems, against a
// reference. The result contains every single error; tables, figures and evo's zip are made from the result.
// The steps, in order:
//
//   frames       both trajectories are converted to camera poses in opencv axes (pose_frames.h)
//   offset       the clock of the estimate is corrected, as given and as estimated (trajectory_offset.h)
//   association  poses are matched by time, frame or row, or the reference is interpolated
//                (trajectory_matching.h)
//   alignment    the estimate is aligned to the reference (lib/metrics/trajectory_alignment.h)
//   errors       absolute or relative errors, then warnings about likely causes of large errors

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/pose_frames.h"
#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/evaluation/trajectory_consistency.h"
#include "sextant/eval/evaluation/trajectory_matching.h"
#include "sextant/eval/evaluation/trajectory_offset.h"
#include "sextant/eval/evaluation/trajectory_warnings.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace sextant {

/// Options of an evaluation.
struct EgoOptions {
  Alignment alignment = Alignment::none;
  int n_to_align = 0;  ///< number of poses that the alignment is estimated from; 0: all
  PoseRelation relation = PoseRelation::trans_part;
  std::vector<PairSelection> rpe_lengths;  ///< pairs of the relative errors; empty: absolute errors
  double max_speed_m_s = 100;              ///< largest speed of the reference; a faster step is an error
  /// Convention of the estimates' covariances; empty: determined by the number of values in a line
  std::optional<CovarianceConvention> covariance;
  bool pairs_from_reference = false;  ///< selects pairs on the reference, not on the estimate
  AssociationOptions association;
  PoseFrame estimate_frame;  ///< applied to every estimate first
  /// Recorded in the results only: to_camera() has already been applied to the reference
  PoseFrame reference_frame;
  std::optional<Eigen::Vector3d> up;  ///< unit vector of both worlds, for Alignment::yaw
  /// Interpolates the reference at the estimate's stamps, over gaps up to this; empty: no interpolation
  std::optional<double> interpolate_max_gap_s;
  bool estimate_offset = false;  ///< estimates an offset and adds it to association.offset_s

  /// Returns the pairs of the first length; null for absolute errors.
  const PairSelection* rpe() const { return rpe_lengths.empty() ? nullptr : &rpe_lengths.front(); }
};

/// A reference trajectory, from a file or from a source.
struct EgoReference {
  PoseSeries poses;
  TrajectorySide side;
  std::vector<std::string> warnings;
  std::optional<double> step_floor_m;    ///< SequenceTruth::camera_step_floor_m
  std::map<std::string, double> floors;  ///< other floors of the truth, by metric key
};

/// Pose change errors (lib/metrics/pair_errors.h), as the paper defines them: of consecutive frames or, if
/// both sides have time stamps, of consecutive matched poses whose distance in time is the median one within
/// half of it.
struct PerFrameErrors {
  std::vector<double> Et_m;
  std::vector<double> ER_deg;
  /// E_R as computed by single-precision code: acos((trace E - 1) / 2) in floats. The smallest value above 0
  /// is 0.028 deg; values that are 0 or NaN are left out, so the mean is larger than that of ER_deg. Serves
  /// only to compare with published numbers.
  std::vector<double> ER_float_acos_deg;
  std::vector<Eigen::Vector3d> step_error_m;  ///< estimated minus true step, in the axes of the previous pose
  std::vector<int> row;                       ///< row in the reference of the current frame of each pair
  size_t n_left_out = 0;                      ///< consecutive matched poses that are not one frame apart
};

/// Relative errors over one of several lengths; empty if no pair of poses is that far apart.
struct ErrorsOverLength {
  PairSelection length;
  std::vector<double> errors;
  std::optional<ErrorStatistics> statistics;
};

/// Result of one estimate: the matched poses, the estimate after the alignment, and their errors.
struct EgoResult : TrajectoryPair {
  std::string name;      ///< name of the estimate in tables
  std::string file{};    ///< file of the estimate
  std::string system{};  ///< system that this run belongs to
  size_t n_reference = 0, n_estimate = 0;
  /// Row of each matched pose in the given reference; the nearest row if the reference was interpolated
  std::vector<int> reference_rows;
  AlignmentResult alignment;
  double offset_s = 0;                   ///< added to the estimate's time stamps, as given or as estimated
  std::optional<OffsetEstimate> offset;  ///< the estimated offset, if one was requested
  std::optional<Interpolation> interpolation;
  std::optional<double> umeyama_scale;  ///< scale of the matched positions; empty if one side stands still
  std::vector<PosePair> pairs;          ///< the pairs of the relative errors, one per error
  std::vector<double> errors;           ///< one per matched pose, or per pair
  ErrorStatistics statistics;
  std::vector<ErrorsOverLength> by_length;  ///< one for each of EgoOptions::rpe_lengths if there are several
  std::optional<TrajectoryConsistency> consistency;
  PerFrameErrors per_frame;  ///< empty if no consecutive frames match
  KittiOdometryErrors kitti;
  std::vector<DataWarning> warnings;

  /// Row of the reference that error i belongs to: the row of the pose, or of the second pose of the pair.
  int row_of(size_t i) const;
  /// Row of the first pose of the pair; 0 without pairs.
  int first_row_of(size_t i) const;
  /// Returns one strictly ascending time per match: the reference's time stamp, or its frame number, or its
  /// row, both as numbers. If several poses of the estimate match the same pose of the reference, the times
  /// are the stamps of the estimate on the reference's clock.
  std::vector<double> times_of_matches() const;
  /// Formats "NAME: TEXT", or the text alone if it already begins with the estimate's file or name.
  std::string text_of(const DataWarning& warning) const;
};

/// Adds the warning "same_run" to each run whose poses equal those of an earlier run of the same system.
void mark_same_runs(std::vector<EgoResult>& runs);
/// Returns the errors of the runs for a comparison; the step of each error is its first_row_of() and
/// row_of(). A run that mark_same_runs() marked has no errors.
std::vector<RunErrors> run_errors(const std::vector<EgoResult>& runs);
/// Returns what is independent: absolute errors accumulate along a path, relative errors depend on their
/// neighbours only.
inline IndependentUnit unit_of_errors(const EgoOptions& options) {
  return options.rpe() ? IndependentUnit::blocks : IndependentUnit::runs;
}

/// Evaluates one estimate. Throws Error if fewer poses match than fewest_matched() (3, and 10 % of the
/// shorter trajectory), if the trajectories cannot be associated or aligned, or if an error is not finite.
EgoResult evaluate_ego(const EgoReference& reference, TrajectoryFile estimate, const std::string& name,
                       const EgoOptions& options);

}  // namespace sextant
