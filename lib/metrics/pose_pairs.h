#pragma once

// Which poses (i, j), i < j, the relative pose error compares. With d_i the length of the path to pose i, a_i
// the sum of its rotation angles, and delta the distance asked for:
//
//   unit            consecutive (pairs do not overlap)              all pairs
//   frames          (0, delta), (delta, 2 delta), ...               every (i, i + delta)
//   metres          between the poses at which the path since the   each i with the j whose d_j - d_i is
//                   last such pose reaches delta; the first pair    nearest to delta, if within tolerance
//                   begins at the first of them
//   degrees, rad    from pose 0: whenever the sum of angles since   every (i, j) whose direct rotation angle
//                   the last pair's end reaches delta               is delta within tolerance
//   seconds         from pose 0: whenever the time since the last   each i with the j whose t_j - t_i is
//                   pair's end reaches delta                        nearest to delta, if within tolerance
//
// The tolerance is relative_tolerance * delta. All but seconds as evo selects them (evo.core.filters 1.3x).

#include <string>
#include <utility>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/geometry/pose_series.h"

namespace sextant {

enum class DeltaUnit { frames, metres, degrees, radians, seconds };
constexpr Names<5> names_of(DeltaUnit) { return {"f", "m", "deg", "rad", "s"}; }

struct PairSelection {
  double delta = 1;
  DeltaUnit unit = DeltaUnit::frames;
  bool all_pairs = false;
  double relative_tolerance = 0.1;

  /// "1f", "10m", "5deg", "0.5rad", "2s". Throws Error on anything else.
  static PairSelection parse(const std::string& text);
  std::string text() const;
};

using PosePair = std::pair<int, int>;

/// Throws Error when the series has no stamps and the unit is seconds, when no pair is found, and for all
/// pairs by angle of more than 100,000 poses (their number grows with the square).
std::vector<PosePair> select_pairs(const PoseSeries& series, const PairSelection& selection);

}  // namespace sextant
