#include "sextant/metrics/depth_error.h"

#include <algorithm>
#include <cmath>

namespace sextant {

DepthError depth_error(std::span<const Image<float>> estimates_m, std::span<const Image<float>> truths_m) {
  SEXTANT_CHECK(estimates_m.size() == truths_m.size());
  const auto usable = [](float z) { return std::isfinite(z) && z > 0; };
  DepthError e;
  for (size_t k = 0; k < truths_m.size(); ++k) {
    const Image<float>&estimate = estimates_m[k], &truth = truths_m[k];
    SEXTANT_CHECK(estimate.width() == truth.width() && estimate.height() == truth.height());
    for (size_t i = 0; i < truth.size(); ++i) {
      const double z = estimate.data()[i], t = truth.data()[i];
      if (!usable(truth.data()[i])) continue;
      ++e.n_truth;
      if (!usable(estimate.data()[i])) continue;
      ++e.n;
      e.mean_m += std::abs(z - t);
      e.rmse_m += (z - t) * (z - t);
      e.relative += std::abs(z - t) / t;
      e.bias += (z - t) / t;
      e.within_125 += std::max(z / t, t / z) < 1.25;
    }
  }
  const double n = e.n > 0 ? static_cast<double>(e.n) : NAN;
  e.mean_m /= n;
  e.rmse_m = std::sqrt(e.rmse_m / n);
  e.relative /= n;
  e.bias /= n;
  e.within_125 /= n;
  e.coverage = e.n_truth > 0 ? static_cast<double>(e.n) / static_cast<double>(e.n_truth) : NAN;
  return e;
}

}  // namespace sextant
