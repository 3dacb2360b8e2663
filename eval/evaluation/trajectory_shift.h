#pragma once

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

#include <functional>
#include <optional>
#include <string>

#include "sextant/eval/evaluation/trajectory_explanation.h"

namespace sextant {

/// Warns of a shift of the clocks. Takes the whole reference and the matched estimate with its own stamps;
/// `offset_s` is the offset that was added to these stamps for the association.
std::optional<TrajectoryWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                                  double offset_s, const AlignmentChoice& choice);

/// Warns if a shift of the matched poses by 1 to 3 rows leaves at most a fifth of the squared errors of the
/// path or of its steps. `remedy` formats the advice, given the number of frames to add to the estimate's.
std::optional<TrajectoryWarning> warning_of_rows_shifted(
    const PoseSeries& reference, const PoseSeries& estimate, const AlignmentChoice& choice,
    const std::function<std::string(int frames)>& remedy);

}  // namespace sextant
