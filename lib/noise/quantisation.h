#pragma once

// Depth as read from a disparity image of finite resolution:
//
//   d = f b / z,   z' = f b / (step * round(d / step))
//
// A disparity that rounds to 0 has no depth: invalid.

#include "sextant/base/with_options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

struct QuantisationOptions {
  SEXTANT_OPTIONS(
      (double, step_px, 0, "px", "resolution of disparity; 0 = none (KITTI files: 0.00390625)"),
      (double, baseline_m, 0, "m", "of the assumed stereo camera; 0 = the source's own bf"))
  void check() const;
};

class Quantisation : public WithOptions<NoiseModel, QuantisationOptions> {
 public:
  explicit Quantisation(const QuantisationOptions& options) : WithOptions(options) {}
  std::string name() const override;
  void corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                     std::span<double> depth_m) const override;
  /// Of a uniform error of one step: step / sqrt(12) in disparity.
  double depth_rounding_sigma_m(const StereoCamera& camera, double depth_m) const override;
  bool changes_depth() const override { return options_.step_px > 0; }
};

}  // namespace sextant
