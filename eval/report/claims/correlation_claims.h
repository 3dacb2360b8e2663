#pragma once

// What noise that is independent from pixel to pixel hides. Sweeps of one data set with the same levels and seeds,
// once with independent and once with spatially correlated noise of the same size (docs/noise.md):
//
//   independent_noise_is_kind  k = mean error with correlated / mean error with independent noise, over the cases that
//                              both have (level, seed, frame), for camera and the three nearest objects; > 1.
//                              Interval: bootstrap over seeds

#include <vector>

#include "sextant/eval/report/claims/claim.h"

namespace sextant {

std::vector<ClaimResult> check_independent_noise_is_kind(const Evidence& evidence);

}  // namespace sextant
