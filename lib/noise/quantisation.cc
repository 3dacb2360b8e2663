#include "sextant/noise/quantisation.h"

#include <cmath>

#include "sextant/noise/depth_noise.h"

namespace sextant {

void QuantisationOptions::check() const {
  check_option(step_px >= 0 && std::isfinite(step_px), "quantisation.step_px", step_px, ">= 0");
  check_option(baseline_m >= 0 && std::isfinite(baseline_m), "quantisation.baseline_m", baseline_m, ">= 0");
}

std::string Quantisation::name() const {
  if (!changes_depth()) return "";
  std::string text = fmt::format("disparity step {} px", options_.step_px);
  if (options_.baseline_m > 0) text += fmt::format(" at b {} m", options_.baseline_m);
  return text;
}

double Quantisation::depth_rounding_sigma_m(const StereoCamera& camera, double depth_m) const {
  if (!changes_depth()) return 0;
  return depth_m * depth_m / focal_baseline(camera, options_.baseline_m) * options_.step_px / std::sqrt(12.0);
}

void Quantisation::corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                                 std::span<double> depth_m) const {
  if (!changes_depth()) return;
  const double bf = focal_baseline(context.camera, options_.baseline_m);
  for (size_t i = 0; i < pixels.size(); ++i) {
    const double steps = std::round(bf / depth_m[i] / options_.step_px);
    depth_m[i] = depth_m[i] > 0 && steps > 0 ? bf / (steps * options_.step_px) : NAN;
  }
}

}  // namespace sextant
