#pragma once

// What makes an evaluation impossible: a truth that no vehicle can drive, and time stamps that do not match.

#include <string>

#include "sextant/geometry/trajectory.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Throws Error "NAME:LINE: ..." where a true step is faster than `max_speed_m_s`, or without time stamps longer
/// than 50 m a frame. Steps below 0.3 m are rounding of stamps.
void check_physical(const PoseSeries& reference, const std::string& name, double max_speed_m_s);

/// Fewer matched poses than this are an Error: 3, and 10 % of the shorter recording.
size_t fewest_matched(size_t n_shorter);

/// What would match: another unit of time, an offset, both, or a larger --max-difference; with the edit or flag.
/// Both have stamps.
std::string explain_unmatched(const PoseSeries& reference, const PoseSeries& estimate,
                              const AssociationOptions& options);

}  // namespace sextant
