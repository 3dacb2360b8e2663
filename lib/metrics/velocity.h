#pragma once

// Speed of an object from its motion H (paper sec. V, after Chirikjian et al. 2017):
//   v = |t - (I - R) c| / dt = |H c - c| / dt,  c = centroid of the object's points, same frame as H.
// Units: m and s in, km/h out. Two readings of the truth:
//   same_formula          the true H at the same centroid c as the estimate;
//   origin_displacement   the true displacement of the label box's origin (published code), i.e. c = origin.

#include "sextant/geometry/se3.h"

namespace sextant {

constexpr double kmh_per_mps = 3.6;

double velocity_kmh(const SE3& H, const Eigen::Vector3d& centroid, double dt_s);

/// E_v = |v_hat - v|.
double velocity_error_kmh(double estimate_kmh, double truth_kmh);

}  // namespace sextant
