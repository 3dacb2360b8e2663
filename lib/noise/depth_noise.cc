#include "sextant/noise/depth_noise.h"

#include <cmath>

namespace sextant {

double focal_baseline(const StereoCamera& camera, double baseline_m) {
  const double bf = baseline_m > 0 ? camera.left.fx * baseline_m : camera.bf;
  if (!(bf > 0)) {
    fail(
        "noise: the source has no stereo baseline (bf = {}): set depth.baseline_m and quantisation.baseline_m",
        bf);
  }
  return bf;
}

void DepthNoiseOptions::check() const {
  check_option(delta_d_px >= 0 && std::isfinite(delta_d_px), "depth.delta_d_px", delta_d_px, ">= 0");
  check_option(baseline_m >= 0 && std::isfinite(baseline_m), "depth.baseline_m", baseline_m, ">= 0");
}

std::string DepthNoise::name() const {
  if (!changes_depth()) return "";
  std::string text = fmt::format("depth {} px", options_.delta_d_px);
  if (options_.baseline_m == 0) {
    text += " at the source's bf";
  } else if (options_.baseline_m != DepthNoiseOptions{}.baseline_m) {
    text += fmt::format(" at b {} m", options_.baseline_m);
  }
  return text;
}

double DepthNoise::depth_sigma_m(const StereoCamera& camera, double depth_m) const {
  if (!changes_depth()) return 0;
  return depth_m * depth_m / focal_baseline(camera, options_.baseline_m) * options_.delta_d_px;
}

void DepthNoise::corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                               std::span<double> depth_m) const {
  if (!changes_depth()) return;
  const double scale = options_.delta_d_px / focal_baseline(context.camera, options_.baseline_m);
  std::vector<double> normal(pixels.size()), unused(pixels.size());
  context.normals(NoiseChannel::depth, pixels, normal, unused);
  for (size_t i = 0; i < pixels.size(); ++i) {
    depth_m[i] += depth_m[i] * depth_m[i] * scale * normal[i];
  }
}

}  // namespace sextant
