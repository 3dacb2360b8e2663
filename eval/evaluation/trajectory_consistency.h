#pragma once

// Consistency of the covariances of an estimate with its errors: the normalised estimation error squared,
//
//   NEES_i = e_i' P_i^-1 e_i,   e = (e_p, e_R) of PoseSeries, after the alignment,
//
// Its mean is 6 if the covariances are right, and 24 if they are four times too small. The interval contains
// the mean of n independent values in 95 % of the cases (chi-square). Errors of neighbouring poses depend on
// each other, so their mean scatters more. Source: Bar-Shalom et al., Estimation with Applications to
// Tracking and Navigation, 2001, 5.4.2.

#include <optional>
#include <string>

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
/// Error "NAME:LINE: ..." if the covariances explain the errors at least five times better with position and
/// rotation exchanged, or with the blocks between them transposed: then the numbers stand in another order.
std::optional<TrajectoryConsistency> trajectory_consistency(const PoseSeries& estimate,
                                                            const PoseSeries& reference,
                                                            const std::string& name);

}  // namespace sextant
