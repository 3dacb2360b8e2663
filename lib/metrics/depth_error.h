#pragma once

// Errors of whole depth images against the truth (m; NaN or <= 0 = no value), over the pixels that have both:
//
//   mean |z - z*|, RMSE, mean |z - z*| / z*, mean (z - z*) / z*, share of max(z / z*, z* / z) < 1.25
//
// Source: Eigen, Puhrsch, Fergus, Depth map prediction from a single image, NIPS 2014.

#include <span>

#include "sextant/measurement/image.h"

namespace sextant {

struct DepthError {
  double mean_m = 0, rmse_m = 0;  ///< NaN when n == 0, like all but coverage
  double relative = 0, bias = 0;  ///< mean |z - z*| / z*, mean (z - z*) / z*
  double within_125 = 0;          ///< 0..1
  int64_t n = 0, n_truth = 0;
  double coverage = 0;  ///< n / n_truth; NaN without truth
};

/// Images of one size each; pairs with truth[i] belonging to estimate[i].
DepthError depth_error(std::span<const Image<float>> estimates_m, std::span<const Image<float>> truths_m);

}  // namespace sextant
