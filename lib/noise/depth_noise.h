#pragma once

// Depth of a stereo camera whose disparity has the accuracy delta_d (paper sec. V; docs/noise.md):
//
//   z' = z + sigma(z) n,   sigma(z) = z^2 / (f b) delta_d,   n ~ N(0, 1)
//
// f = fx of the camera (px), b = baseline. z' <= 0 is invalid: never clamped.

#include "sextant/base/with_options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

/// f b in px m: fx * baseline_m, or the source's own bf where baseline_m is 0.
double focal_baseline(const StereoCamera& camera, double baseline_m);

struct DepthNoiseOptions {
  SEXTANT_OPTIONS(
      (double, delta_d_px, 0, "px", "disparity accuracy; 0.1 to 0.2 is a normal industrial stereo camera"),
      (double, baseline_m, 0.5, "m", "of the assumed stereo camera (paper: 0.5); 0 = the source's own bf"))
  void check() const;
};

class DepthNoise : public WithOptions<NoiseModel, DepthNoiseOptions> {
 public:
  explicit DepthNoise(const DepthNoiseOptions& options) : WithOptions(options) {}
  std::string name() const override;
  void corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                     std::span<double> depth_m) const override;
  double depth_sigma_m(const StereoCamera& camera, double depth_m) const override;
  bool changes_depth() const override { return options_.delta_d_px > 0; }
};

}  // namespace sextant
