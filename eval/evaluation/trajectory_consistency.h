#pragma once

// Whether the covariances of an estimate fit its errors: the normalised estimation error squared,
//
//   NEES_i = e_i' P_i^-1 e_i,   e = (e_p, e_R) of PoseSeries, after the alignment,
//
// 6 in the mean where the covariances are right, 24 where they are four times too small. The interval is where the
// mean of n independent values lies in 95 % of the cases (chi-square); errors of neighbouring poses depend on each
// other, which makes it wider. Source: Bar-Shalom et al., Estimation with Applications to Tracking and Navigation,
// 2001, 5.4.2.

#include <optional>
#include <string>

#include "sextant/geometry/trajectory.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct TrajectoryConsistency {
  size_t n = 0;
  double nees = 0;           ///< mean of all 6, or without rotations of the reference 3, degrees of freedom
  double position_nees = 0;  ///< mean of the marginal covariances of position, 3
  std::optional<double> rotation_nees;  ///< the same of rotation, 3
  int dof = 6;
  Interval interval;  ///< of the mean, 95 %

  bool is_consistent() const { return interval.low <= nees && nees <= interval.high; }
};

/// Both matched, the estimate aligned; empty without covariances. Throws Error "NAME:LINE: ..." where the order of the
/// numbers is wrong: with position and rotation exchanged, or with the blocks between them transposed, the
/// covariances explain the errors at least five times better.
std::optional<TrajectoryConsistency> trajectory_consistency(const PoseSeries& estimate, const PoseSeries& reference,
                                                            const std::string& name);

}  // namespace sextant
