#pragma once

// Errors of the KITTI odometry benchmark: over every stretch of 100, 200, .. 800 m of the true path that
// begins at pose 0, 10, 20, ...,
//
//   E = inverse(inverse(P_first) P_last) inverse(Q_first) Q_last      P estimate, Q truth
//   translation = |trans E| / length (%),   rotation = angle(E) / length (deg/m)
//
// averaged over all stretches. `last` is the first pose whose path from `first` exceeds the length.
// Recordings shorter than 100 m have no such error: n = 0, and the means are empty, never 0. Source: A.
// Geiger, P. Lenz, R. Urtasun, Are we ready for autonomous driving?, CVPR 2012, and its devkit.

#include <optional>
#include <vector>

#include "sextant/geometry/pose_series.h"

namespace sextant {

struct KittiOdometryError {
  double length_m = 0;  ///< of the stretches; 0: all lengths together
  int n = 0;            ///< stretches
  std::optional<double> translation_percent;
  std::optional<double> rotation_deg_per_m;
};

struct KittiOdometryErrors {
  KittiOdometryError all;
  std::vector<KittiOdometryError> by_length;  ///< 100 .. 800 m
  double path_m = 0;                          ///< length of the true path
};

/// Of one length each.
KittiOdometryErrors kitti_odometry_errors(const PoseSeries& estimate, const PoseSeries& reference);

}  // namespace sextant
