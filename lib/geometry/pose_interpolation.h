#pragma once

// Poses between recorded ones. Between stamps t_i <= t <= t_j that follow each other,
// w = (t - t_i) / (t_j - t_i):
//
//   p = (1 - w) p_i + w p_j          R = R_i exp(w log(R_i' R_j))      (straight line; slerp, the shorter way)
//
// At a recorded stamp it is the recorded pose, bit for bit. Nothing is extrapolated, and no gap longer than
// max_gap_s is bridged.

#include <span>
#include <vector>

#include "sextant/geometry/pose_series.h"

namespace sextant {

struct InterpolatedPoses {
  PoseSeries poses;             ///< stamps as asked for; no frame numbers
  std::vector<int> rows;        ///< of the recorded pose nearest in time, the earlier of two as near
  std::vector<int> asked;       ///< index into the times asked for
  double largest_gap_s = 0;     ///< that was bridged
  size_t n_outside = 0;         ///< times before the first or after the last pose
  size_t n_in_longer_gaps = 0;  ///< times within gaps above max_gap_s
};

/// `series` has stamps, strictly ascending; times ascending.
InterpolatedPoses interpolate_poses(const PoseSeries& series, std::span<const double> times_s,
                                    double max_gap_s);

}  // namespace sextant
