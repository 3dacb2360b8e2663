#pragma once

// What is suspicious about a pair of trajectories, told before somebody believes the numbers. Each warning
// has a code that programs can test and a text that says what was seen and what to do.
//
//   swapped         the estimate calls itself ground truth (name, comment), or the reference calls itself an
//                   estimate, or the estimate is the denser and longer of the two by far
//   scale           Umeyama's scale is outside 0.9 .. 1.1 although the alignment does not correct it
//   rates           median time steps differ by more than a factor of 1.5
//   unmatched       less than 80 % of the poses of the shorter trajectory have a partner
//   coverage        the matched poses span less than 80 % of the reference's time or frames
//   rows            one side has frame numbers that do not begin at 0, the other has none: its rows are taken
//                   as frames
//   clock           median time steps of below 1e-5 s or above 1000 s: another unit than seconds?
//   lag             speed and rotation rate agree much better when the estimate is shifted in time
//   repeated_poses  the estimate stands still, exactly, while the reference moves: 5 poses or more
//   identity        the reference holds exact identity poses after it, or the estimate, has left its origin:
//                   missing truth, logged as identity
//   identical       all poses of both are equal: the same file twice?
//   line            the aligned positions lie on a line: the rotation about it is arbitrary

#include <string>
#include <vector>

#include "sextant/geometry/trajectory.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

struct TrajectoryWarning {
  std::string code;
  std::string text;
};

/// What is known of one side besides its poses.
struct TrajectorySide {
  std::string name;      ///< file name
  std::string comments;  ///< of its first lines, lower case
  std::string format;
};

/// Before association: swapped, clock, rates.
std::vector<TrajectoryWarning> warnings_of_pair(const PoseSeries& reference,
                                                const TrajectorySide& reference_side,
                                                const PoseSeries& estimate,
                                                const TrajectorySide& estimate_side);

/// After association, before alignment: repeated poses, identities.
std::vector<TrajectoryWarning> warnings_of_matched(const PoseSeries& reference, const PoseSeries& estimate);

}  // namespace sextant
