#pragma once

// Which poses of two recordings belong together.
//
//   by time    each stamp of the shorter recording (of two as long, the estimate's) takes the nearest stamp
//              of the other, the earlier of two as near, when they differ by at most max_difference_s.
//              The offset is added to the stamps of the estimate.
//              A pose of the longer recording may be taken twice.
//   by frame   frame numbers that both have
//   by row     row i with row i; as many rows in both
//
// Association by time gives evo's pairs (evo.core.sync, version 1.3x).

#include <optional>
#include <vector>

namespace sextant {

struct AssociationOptions {
  double max_difference_s = 0.01;
  double offset_s = 0;                   ///< added to the estimate's stamps
  std::optional<double> start_s, end_s;  ///< of the reference's stamps, inclusive
};

/// Index pairs, ascending in both.
struct Association {
  std::vector<int> reference;
  std::vector<int> estimate;
};

/// Stamps ascending. With an empty result nothing matches.
Association associate_by_time(const std::vector<double>& reference_s, const std::vector<double>& estimate_s,
                              const AssociationOptions& options);
/// Frame numbers strictly ascending.
Association associate_by_frame(const std::vector<int>& reference, const std::vector<int>& estimate);

}  // namespace sextant
