#pragma once

// Time offset between two clocks, estimated from the motions alone: speeds and rotation rates do not depend
// on the world frame, on the mounting or on drift.
//
//   signals   speed and rotation rate of each step between poses, smoothed by a Gaussian of one step (the
//             longer of the two median steps) and sampled at such steps. Without smoothing, interpolation
//             would average the noise at fractional shifts only, and would favour shifts between the samples.
//             Steps longer than ten median steps are gaps; nothing is compared within them
//   score     L(d) = -n/2 sum over both signals of log(1 - rho(d)^2), where rho is the correlation (0 if
//             negative) of the estimate at t with the reference at t + d. This is the profile likelihood of
//             signals that are equal up to scale, bias and noise, and weights each signal by how well it
//             agrees
//   centre    the search is centred at the given offset, unless a distant one leaves at most half of the
//             unexplained share prod(1 - rho^2) over both signals; between half and 0.8 of that share neither
//             is certain, and no offset is reported. All offsets are compared at which half of the shorter
//             recording overlaps
//   search    on a grid of half steps, then by golden section
//   interval  95 %, by the jackknife over 20 stretches of time with Student's t, and extended to every offset
//             of the grid at which L is not significantly below its maximum: by at most t standard errors
//             of the difference, from the same jackknife. A flat or noisy L has further maxima, which the
//             spread of one maximum does not show. Errors that persist throughout the recording are not
//             included

#include <string>
#include <vector>

#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Median difference of successive times; needs at least two times.
double median_step(const std::vector<double>& times);

/// Formats "--interpolate GAP" with 1.5 times the reference's median time step, which bridges its usual
/// steps. Needs at least two stamps.
std::string interpolate_flag(const std::vector<double>& reference_stamps_s);

/// Offset to add to the estimate's stamps, with its interval.
struct OffsetEstimate {
  double offset_s = 0;
  double low_s = 0, high_s = 0;  ///< 95 % interval
  double speed_correlation = 0, rotation_correlation = 0;
  size_t n = 0;  ///< number of times compared
};

/// Tries offsets up to 20 of the longer time steps, or 1 s if that is longer (but 200 steps at most), around
/// the centre, which is `initial_s` or distant. Throws Error "NAME: ..." if the motions do not determine the
/// offset: an uncertain centre, fewer than 40 times to compare, correlations below 0.8, or the best offset or
/// its interval at the end of the range.
OffsetEstimate estimate_offset(const PoseSeries& reference, const PoseSeries& estimate, double initial_s,
                               const std::string& name);

}  // namespace sextant
