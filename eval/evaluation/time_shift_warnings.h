#pragma once

// Warnings of a shift in time between estimate and reference, of the clock or of the frame numbers. Those of
// a shift have the code "lag":
//
//   motions  the interval of estimate_offset() lies outside half a time step, and the offset halves the
//            position RMSE or the squared differences of the steps
//   clocks   a shift explains more than half of the squared position errors, and the interval of
//            estimate_offset(), from the motions alone, does not contain 0
//   rows     a shift of the matched poses by 1 to 3 rows leaves at most a fifth of the squared errors
//            of the path, and less than an alignment with scale without the shift, or of its steps
//
// "no_offset": the motions have a shift that halves neither. It is not reported if the shift increases the
// position RMSE, or if this RMSE is at most 5 % of the RMS extent of the reference. "clock_rate": the
// times of the estimate, stretched to begin and end with those of the reference, leave at most a fifth of the
// squared errors, also of those after an alignment with scale. "reversed": the same, for the poses in the
// opposite order.

#include <functional>
#include <optional>
#include <string>

#include "sextant/eval/evaluation/trajectory_explanation.h"
#include "sextant/eval/evaluation/trajectory_offset.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Formats the flags that correct the estimate's clock: "--offset -0.2500, or --estimate-offset".
using OffsetRemedy = std::function<std::string(double offset_s)>;

/// Warns of a lag of the motions that remains after `offset_s` is added to the estimate's stamps ("lag", or
/// "no_offset"). Takes both trajectories before they are matched; times are stamps if both have them,
/// otherwise frame numbers.
std::optional<DataWarning> warning_of_lag(const PoseSeries& reference, const PoseSeries& estimate,
                                          double offset_s, const AlignmentChoice& choice,
                                          const OffsetRemedy& remedy);

/// Warns of a clock at another rate, or of an estimate in the opposite order. Takes the same trajectories.
std::optional<DataWarning> warning_of_clock_rate(const PoseSeries& reference, const PoseSeries& estimate,
                                                 double offset_s, const AlignmentChoice& choice);

/// Warns of a shift of the clocks. Takes the whole reference and the matched estimate with its own stamps;
/// `offset_s` is the offset that was added to these stamps for the association.
std::optional<DataWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                            double offset_s, const AlignmentChoice& choice,
                                            const OffsetRemedy& remedy);

/// Warns of a shift of the matched poses by whole rows. Without stamps, the frames must be successive.
std::optional<DataWarning> warning_of_rows(const TrajectoryPair& pair, double offset_s,
                                           const AlignmentChoice& choice, const OffsetRemedy& remedy);

}  // namespace sextant
