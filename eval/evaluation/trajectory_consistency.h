#pragma once

// Consistency of the covariances of an estimate with its errors: the normalised estimation error squared,
//
//   NEES_i = e_i' P_i^-1 e_i,   e = (e_p, e_R) of PoseSeries, after the alignment,
//
// Its mean is 6 if the covariances are right, and 24 if they are four times too small. With right
// covariances, the interval contains the mean of n independent values in 95 % of the cases (chi-square).
// Errors of neighbouring poses depend on each other, so the mean of actual recordings scatters more. Source:
// Bar-Shalom et al., Estimation with Applications to Tracking and Navigation, 2001, 5.4.2.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/report/table.h"
#include "sextant/geometry/trajectory.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Mean NEES of a trajectory.
struct TrajectoryConsistency {
  size_t n = 0;
  double nees = 0;  ///< mean over the poses; 6 degrees of freedom, or 3 if the reference has no rotations
  double position_nees =
      0;  ///< mean NEES of the position under its marginal covariance, 3 degrees of freedom
  /// Mean NEES of the rotation under its marginal covariance, 3 degrees of freedom
  std::optional<double> rotation_nees;
  int dof = 6;
  Interval interval;  ///< 95 % interval of the mean under right covariances

  bool is_consistent() const { return interval.low <= nees && nees <= interval.high; }
};

/// Computes the NEES of matched poses, the estimate after the alignment; empty without covariances. Throws
/// Error "NAME:LINE: ..." if a covariance is not positive definite, or if the numbers seem to be in another
/// order: with position and rotation exchanged, the NEES is at least five times smaller (and above 6 as
/// declared), or with the blocks between them transposed, twice the log-likelihood is larger by more than 25
/// and by more than 1 per pose.
std::optional<TrajectoryConsistency> trajectory_consistency(const PoseSeries& estimate,
                                                            const PoseSeries& reference,
                                                            const std::string& name);

/// The columns of the mean NEES with its interval, and of those of position and rotation.
Fields<TrajectoryConsistency> consistency_fields();

// ---- Consistency of the covariances of logged objects with their errors: the NEES defined above
// for each object.
//
//   pose covariances     errors of T_world_object against the true poses, in one world, without an alignment
//   motion covariances   errors of the motions against the true motions, in the frame of the log

/// NEES of one object in one run.
struct ObjectConsistency {
  std::string system;
  uint64_t run = 0;
  int object = 0;
  TrajectoryConsistency nees;
};

/// Returns the NEES of each object that has covariances and truth. Throws Error as trajectory_consistency()
/// does.
std::vector<ObjectConsistency> object_consistency(const ObjectLog& log, uint64_t run = 0);

/// Table with one row per system, run and object.
Table object_consistency_table(const std::vector<ObjectConsistency>& found);

}  // namespace sextant
