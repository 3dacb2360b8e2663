#pragma once

// Time offset between two clocks, estimated from the motions alone: speeds and rotation rates do not depend
// on the world frame, on the mounting or on drift.
//
// estimate_lag() is a fast check for warnings; estimate_offset() measures the offset:
//
//   signals   speed and rotation rate of each step between poses, smoothed by a Gaussian of one step (the
//             longer of the two median steps) and sampled at such steps. Without smoothing, interpolation
//             would average the noise at fractional shifts only, and would favour shifts between the samples
//   score     L(d) = -n/2 sum over both signals of log(1 - rho(d)^2), where rho is the correlation (0 if
//             negative) of the estimate at t with the reference at t + d. This is the profile likelihood of
//             signals that are equal up to scale, bias and noise, and weights each signal by how well it
//             agrees
//   centre    the search is centred at the given offset, unless a distant one leaves at most half of the
//             unexplained share prod(1 - rho^2) over both signals; between half and 0.8 of that share neither
//             is certain, and no offset is reported. All offsets are compared at which half of the shorter
//             recording overlaps
//   search    on a grid of half steps, then by golden section
//   interval  95 %, by the jackknife over 20 stretches of time with Student's t. It does not include errors
//             that persist throughout the recording

#include <fmt/format.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/trajectory_explanation.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Median difference of successive times; needs at least two times.
double median_step(const std::vector<double>& times);

/// Shift of the estimate's clock at which the motions agree best: its stamps are late by `lag`. Shifts up to
/// 20 of the longer time steps, or 1 s if that is longer (but 200 steps at most), around the centre are
/// tried. Empty if the centre is not certain, if a recording has fewer than 40 poses or both overlap too
/// little, if the correlation is below 0.8, or if it exceeds the unshifted correlation neither by 0.1 nor by
/// half of the difference to 1.
struct LagEstimate {
  double lag = 0;            ///< in units of the times
  double correlation = 0;    ///< correlation of speeds and rotation rates at this lag
  double correlation_0 = 0;  ///< correlation without a shift
};
std::optional<LagEstimate> estimate_lag(const PoseSeries& reference,
                                        const std::vector<double>& reference_times,
                                        const PoseSeries& estimate,
                                        const std::vector<double>& estimate_times);

/// Formats "--interpolate GAP" with 1.5 times the reference's median time step, which bridges its usual
/// steps. Needs at least two stamps.
std::string interpolate_flag(const std::vector<double>& reference_stamps_s);

/// Formats the flags that correct the estimate's clock. An estimated offset need not be a multiple of the
/// time steps, so --estimate-offset is named with --interpolate unless the reference is interpolated already.
class OffsetRemedy {
 public:
  OffsetRemedy(const std::vector<double>& reference_stamps_s, bool interpolates)
      : interpolate_(
            interpolates || reference_stamps_s.size() < 2 ? "" : " " + interpolate_flag(reference_stamps_s)) {
  }
  /// Returns e.g. "--offset -0.2500, or --estimate-offset --interpolate 0.15".
  std::string operator()(double offset_s) const {
    return fmt::format("--offset {:.4f}, or --estimate-offset{}", offset_s, interpolate_);
  }

 private:
  std::string interpolate_;
};

/// Offset to add to the estimate's stamps, with its interval.
struct OffsetEstimate {
  double offset_s = 0;
  double low_s = 0, high_s = 0;  ///< 95 % interval
  double speed_correlation = 0, rotation_correlation = 0;
  size_t n = 0;  ///< number of times compared
};

/// Searches around the centre, which is `initial_s` or distant, over the range of estimate_lag(). Throws
/// Error "NAME: ..." if the motions do not determine the offset: an uncertain centre, fewer than 40 times to
/// compare, correlations below 0.8, or the best offset at the end of the range.
OffsetEstimate estimate_offset(const PoseSeries& reference, const PoseSeries& estimate, double initial_s,
                               const std::string& name);

// ---- warnings

// Explanations of a trajectory's error by a shift in time, of the clock or of the frame numbers. Both have
// the code "lag":
//
//   shift      remedy              warned when
//   clock      --offset            a shift of the clock explains more than half of the squared position
//                                  errors, and the interval of estimate_offset(), from the motions alone,
//                                  does not contain 0
//   rows       as given            a shift of the matched poses by 1 to 3 rows leaves at most a fifth of the
//                                  squared errors of the path or of its steps
//
// The evaluation also reports "lag" for a shift of one step or more that estimate_lag() finds, however much
// it explains (ego_evaluation.cc).

/// Warns of a shift of the clocks. Takes the whole reference and the matched estimate with its own stamps;
/// `offset_s` is the offset that was added to these stamps for the association.
std::optional<TrajectoryWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                                  double offset_s, const AlignmentChoice& choice,
                                                  const OffsetRemedy& remedy);

/// Warns if a shift of the matched poses by 1 to 3 rows leaves at most a fifth of the squared errors of the
/// path or of its steps. `remedy` formats the advice, given the number of frames to add to the estimate's.
std::optional<TrajectoryWarning> warning_of_rows_shifted(
    const PoseSeries& reference, const PoseSeries& estimate, const AlignmentChoice& choice,
    const std::function<std::string(int frames)>& remedy);

}  // namespace sextant
