#pragma once

// Velocity error of one object step, E_v = |v_hat - v| in km/h. The speed v of a motion: geometry/object_motion.h.
// Two readings of the truth:
//   same_formula          the true H at the same centroid as the estimate;
//   origin_displacement   the true displacement of the label box's origin (published code)

#include <cmath>

namespace sextant {

inline double velocity_error_kmh(double estimate_kmh, double truth_kmh) {
  return std::abs(estimate_kmh - truth_kmh);
}

}  // namespace sextant
