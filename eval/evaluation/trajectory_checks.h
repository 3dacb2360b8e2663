#pragma once

// Checks for data that cannot be evaluated: a truth that no vehicle can drive, and time stamps that do not
// match.

#include <string>

#include "sextant/geometry/trajectory.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Throws Error "NAME:LINE: ..." if a true step is faster than `max_speed_m_s`, or, without time stamps,
/// longer than 50 m per frame. Steps below 0.3 m pass, because rounded time stamps make them look fast.
void check_physical(const PoseSeries& reference, const std::string& name, double max_speed_m_s);

/// Smallest number of matched poses that can be evaluated: 3, and 10 % of the poses of the shorter recording.
size_t fewest_matched(size_t n_shorter);

/// Explains why few poses match, for recordings with time stamps: names the unit of time, the offset, both,
/// or the larger --max-difference with which poses would match, and the edit or flag for it.
std::string explain_unmatched(const PoseSeries& reference, const PoseSeries& estimate,
                              const AssociationOptions& options);

}  // namespace sextant
