#pragma once

// Where the level of a series changes: optimal partitioning (Jackson et al. 2005). Of all ways to cut the
// series into segments, the one with the least
//
//   sum over segments of sum |x - median of the segment| / scale   +   penalty per cut
//
//   penalty   2 + 2 ln n
//   scale     noise of the series, 1.4826 MAD of its steps / sqrt 2, but so large that a step of `min_step`
//             that lasts for one value just pays for its cut: smaller steps are never cuts
//
// Absolute deviations: one disturbed value inside a segment costs less than the two cuts around it, unless it
// is far out. O(n^3) for n values; meant for the history of a project.

#include <span>
#include <vector>

namespace sextant {

/// Indices of the first values of new segments, rising; never 0. Throws Error for values that are not finite
/// and for min_step < 0. Fewer than 2 values have no change.
std::vector<size_t> change_points(std::span<const double> values, double min_step);

}  // namespace sextant
