#pragma once

// Warnings about a suspicious pair of trajectories, printed with the results. Each warning has a code that
// programs can test, and a text with the finding and the remedy.
//
//   swapped         the name or comments of the estimate call it ground truth, or those of the reference call
//                   it an estimate, or the estimate is much denser than a reference with rotations, and
//                   longer than it by 2 % and two of its steps
//   scale           Umeyama's scale is outside 1 / 1.1 .. 1.1, and the alignment does not correct it
//   rates           median time steps differ by more than a factor of 1.5
//   unmatched       less than 80 % of the poses of the shorter trajectory have a partner
//   coverage        the matched poses span less than 80 % of the reference's time or frames
//   rows            one side has frame numbers that do not begin at 0, the other has none, so that its rows
//                   are taken as frame numbers
//   clock           a median time step below 1e-5 s or above 1000 s: is the unit not seconds?
//   lag             speed and rotation rate agree much better when the estimate is shifted in time
//   repeated_poses  the estimate repeats a pose exactly, 5 times or more, while the reference moves
//   jump            the estimate jumps in up to three steps, ten times more than in all others, and by a
//                   twentieth of the reference's extent: a tracker that started again
//   lost_poses      the estimate contains exact identity poses after it, or the reference, has left the
//                   origin: lost frames that were written as identity; jumps are not reported then
//   identity        the reference contains exact identity poses after it, or the estimate, has left the
//                   origin: missing truth that was logged as identity
//   no_rotations    all rotations of one side are equal while the other side turns by 5 deg or more
//   rounded         the coordinates of one side are multiples of a power of ten that explains more than half
//                   of the squared errors of relative translations, which do not accumulate over two poses
//   identical       all poses of both are equal: the same file twice?
//   same_run        all poses equal those of an earlier run of the same system (ego_evaluation.h)
//   line            the aligned positions lie on a line: the rotation about it is arbitrary
//   still_pairs     pairs between which the reference stands still are left out of relative errors in percent
//   repaired        the file was repaired while it was read (trajectory_files.h)
//
// trajectory_explanation.h and trajectory_offset.h define further codes.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Description of one side besides its poses.
struct TrajectorySide {
  std::string name;      ///< file name
  std::string comments;  ///< as in TrajectoryFile, in lower case
  std::string format;
};

/// Checks that need no association: swapped, clock, rates. `interpolates`: the reference is interpolated at
/// the estimate's time stamps.
std::vector<DataWarning> warnings_of_pair(const PoseSeries& reference, const TrajectorySide& reference_side,
                                          const PoseSeries& estimate, const TrajectorySide& estimate_side,
                                          bool interpolates = false);

/// Checks after the association and before the alignment: lost_poses, jump, no_rotations, rounded,
/// repeated_poses, identity, identical.
std::vector<DataWarning> warnings_of_matched(const TrajectoryPair& pair);

/// Returns the poses without those that are exactly the identity after the first other one, as of lost
/// frames; empty if there are none. They would look like a motion to the origin and back.
std::optional<PoseSeries> without_identities(const PoseSeries& poses);

// ---- Checks for data that cannot be evaluated: a truth that no vehicle can drive, and time stamps that do
// not match.

/// Throws Error "NAME:LINE: ..." if a true step is faster than `max_speed_m_s`, or, without time stamps,
/// longer than 50 m per frame. Steps below 0.3 m pass, because rounded time stamps make them look fast.
void check_physical(const PoseSeries& reference, const std::string& name, double max_speed_m_s);

/// Smallest number of matched poses that can be evaluated: 3, and 10 % of the poses of the shorter recording.
size_t fewest_matched(size_t n_shorter);

/// Explains why few poses match, for recordings with time stamps. The text names the ranges of the stamps
/// and, if another unit of time, an offset, both, or a larger --max-difference would let poses match, the
/// edit or flag for this.
std::string explain_unmatched(const PoseSeries& reference, const PoseSeries& estimate,
                              const AssociationOptions& options);

}  // namespace sextant
