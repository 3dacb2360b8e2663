#pragma once

// Detects logs that number the objects differently from their truth: exchanged ids, or ids off by one.
//
// With r(a, t) the residual (motion_readings.h) of the motions logged for the id a against the reference of
// the object t, over the steps that both have, the motions of a are taken for those of t if
//
//   n r(a, t) < r(a, a),    n r(a, t) < r(t, t),    n r(a, t) < the residual of an object that stands still
//
// with n twice the factor of explains_times_of(). The second condition leaves out a logged object that
// resembles another one which is logged correctly, the third one resting objects, which are all alike.

#include <map>
#include <optional>

#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {

/// Logged id -> id of the object whose motions it has; only ids that differ, and each object once.
std::map<int, int> exchanged_ids(const MotionData& data);

/// Returns the hypothesis that the objects have the ids of exchanged_ids(); nullopt if there are none.
std::optional<Hypothesis<MotionData>> exchanged_ids_hypothesis(const MotionData& data);

}  // namespace sextant
