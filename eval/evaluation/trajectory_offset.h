#pragma once

// The time offset of two clocks from the motions alone: how fast each moves and turns does not depend on
// world, mounting or drift.
//
// estimate_lag() is a quick look for warnings; estimate_offset() measures:
//
//   signals   speed and rotation rate of each step between poses, smoothed by a Gaussian of one step (the
//             longer of the two medians) at times one such step apart. Without smoothing, interpolation would
//             average noise at fractional shifts alone, and the best shift would lie between the samples, wrongly
//   score     L(d) = -n/2 sum over both of log(1 - rho(d)^2), rho the correlation (0 where it is negative) of
//             the estimate at t with the reference at t + d: the profile likelihood for signals equal up to
//             scale, bias and noise, so that each counts as much as it agrees
//   search    steps of half a step, then golden section
//   interval  95 %: jackknife over 20 stretches of time, Student's t. Errors that go on through the whole
//             recording are not in it

#include <optional>
#include <string>
#include <vector>

#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Of at least two times.
double median_step(const std::vector<double>& times);

/// The shift of the estimate's clock that makes motions agree best: its stamps are late by lag_s. Looked for
/// up to 20 of the longer time steps, or 1 s where that is more. Empty when nothing stands out: too little
/// motion, correlation below 0.8, or better than without a shift by neither 0.1 nor half of what is missing
/// to 1.
struct LagEstimate {
  double lag = 0;            ///< in units of the times
  double correlation = 0;    ///< of speeds and rotation rates at this lag
  double correlation_0 = 0;  ///< without
};
std::optional<LagEstimate> estimate_lag(const PoseSeries& reference,
                                        const std::vector<double>& reference_times,
                                        const PoseSeries& estimate,
                                        const std::vector<double>& estimate_times);

/// What to add to the estimate's stamps.
struct OffsetEstimate {
  double offset_s = 0;
  double low_s = 0, high_s = 0;  ///< 95 %
  double speed_correlation = 0, rotation_correlation = 0;
  size_t n = 0;  ///< times compared
};

/// Around `initial_s`, as far as estimate_lag(). Throws Error "NAME: ..." where the motions do not determine
/// it: fewer than 40 times to compare, correlations below 0.8, or the best at the end of the range.
OffsetEstimate estimate_offset(const PoseSeries& reference, const PoseSeries& estimate, double initial_s,
                               const std::string& name);

}  // namespace sextant
