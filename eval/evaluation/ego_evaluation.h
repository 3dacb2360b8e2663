#pragma once

// Evaluates recorded camera trajectories against a reference; of one run or of several runs of several
// systems. The result holds every raw error, so that tables, figures and evo's zip are functions of it. In
// this order:
//
//   frames       both to poses of a camera in opencv axes (pose_frames.h)
//   offset       the estimate's clock, as given and as estimated (trajectory_offset.h)
//   association  by time, frame or row; or the reference interpolated (lib/geometry/trajectory.h)
//   alignment    (lib/metrics/trajectory_alignment.h)
//   errors       absolute or relative; then warnings of what would explain them

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/pose_frames.h"
#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/evaluation/trajectory_consistency.h"
#include "sextant/eval/evaluation/trajectory_offset.h"
#include "sextant/eval/evaluation/trajectory_warnings.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace sextant {

struct EgoOptions {
  Alignment alignment = Alignment::none;
  int n_to_align = 0;  ///< 0: all poses
  PoseRelation relation = PoseRelation::trans_part;
  std::optional<PairSelection> rpe;          ///< empty: absolute errors
  std::vector<PairSelection> rpe_lengths;    ///< where several were given: all of them, `rpe` is the first
  double max_speed_m_s = 100;                ///< of the reference; faster is an error
  std::optional<CovarianceConvention> covariance;  ///< of the estimates' files; empty: by how many numbers
  bool pairs_from_reference = false;
  AssociationOptions association;
  PoseFrame estimate_frame;                     ///< applied to every estimate first
  PoseFrame reference_frame;                    ///< told in results; for to_camera() of the reference, once
  std::optional<Eigen::Vector3d> up;            ///< unit vector of both worlds, for Alignment::yaw
  std::optional<double> interpolate_max_gap_s;  ///< the reference is interpolated at the estimate's stamps
  bool estimate_offset = false;                 ///< added to association.offset_s
};

/// A reference trajectory, from a file or from a source.
struct EgoReference {
  PoseSeries poses;
  TrajectorySide side;
  std::vector<std::string> warnings;
  std::optional<double> step_floor_m;     ///< SequenceTruth::camera_step_floor_m
  std::map<std::string, double> floors;  ///< the others, by metric key
};

/// How the reference was interpolated.
struct Interpolation {
  double largest_gap_s = 0;                    ///< that was bridged
  size_t n_outside = 0, n_in_longer_gaps = 0;  ///< poses of the estimate left out
};

/// Pose change errors of consecutive frames (lib/metrics/pair_errors.h), the paper's definition.
struct PerFrameErrors {
  std::vector<double> Et_m;
  std::vector<double> ER_deg;
  /// E_R as code in single precision has it: acos((trace E - 1) / 2) in floats. It has steps of 0.028 deg,
  /// and steps where it is 0 or NaN are left out, so its mean is larger than that of ER_deg. For comparison
  /// with published numbers only.
  std::vector<double> ER_float_acos_deg;
  std::vector<Eigen::Vector3d> step_error_m;  ///< estimated minus true step, axes of the previous pose
  std::vector<int> row;                       ///< of the reference: the current frame of each pair
};

/// Relative errors over one of several lengths; without errors where no pair is that far apart.
struct ErrorsOverLength {
  PairSelection length;
  std::vector<double> errors;
  std::optional<ErrorStatistics> statistics;
};

struct EgoResult {
  std::string name;    ///< of the estimate, as tables print it
  std::string file{};    ///< of the estimate
  std::string system{};  ///< to which this run belongs
  size_t n_reference = 0, n_estimate = 0;
  PoseSeries reference, estimate;  ///< matched; estimate aligned
  std::vector<int>
      reference_rows;  ///< of the matched poses in the reference as given; interpolated: the nearest
  AlignmentResult alignment;
  std::optional<OffsetEstimate> offset;  ///< as estimated
  std::optional<Interpolation> interpolation;
  double umeyama_scale = 1;     ///< of the matched positions, 1 where it is not determined
  std::vector<PosePair> pairs;  ///< of relative errors, one per error
  std::vector<double> errors;   ///< one per matched pose, or per pair
  ErrorStatistics statistics;
  std::vector<ErrorsOverLength> by_length;  ///< one for each of EgoOptions::rpe_lengths
  std::optional<TrajectoryConsistency> consistency;
  PerFrameErrors per_frame;  ///< may be empty
  KittiOdometryErrors kitti;
  std::vector<TrajectoryWarning> warnings;

  /// Row of the reference that error i belongs to: that of the pose, or of a pair's second pose.
  int row_of(size_t i) const;
  /// "NAME: TEXT"; the text alone where it begins with the estimate's file or name already.
  std::string text_of(const TrajectoryWarning& warning) const;
};

/// The errors of runs for comparison; each belongs to the row row_of() of the reference.
std::vector<RunErrors> run_errors(const std::vector<EgoResult>& runs);

/// Throws Error where less than 3 poses or 10 % match, or the trajectories cannot be aligned.
EgoResult evaluate_ego(const EgoReference& reference, TrajectoryFile estimate, const std::string& name,
                       const EgoOptions& options);

}  // namespace sextant
