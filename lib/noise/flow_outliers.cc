#include "sextant/noise/flow_outliers.h"

#include <cmath>

#include "sextant/noise/box_muller.h"

namespace sextant {

void FlowOutlierOptions::check() const {
  check_option(share >= 0 && share <= 1, "outliers.share", share, "in 0..1");
  check_option(radius_px > 0 && std::isfinite(radius_px), "outliers.radius_px", radius_px, "> 0");
}

std::string FlowOutliers::name() const {
  if (!changes_flow()) return "";
  return fmt::format("outliers {:.6g} % in {} {} px", options_.share * 100, to_string(options_.shape),
                     options_.radius_px);
}

void FlowOutliers::corrupt_flow(const NoiseContext& context, const PixelBatch& pixels,
                                const FlowBatch& flow) const {
  if (!changes_flow()) return;
  const auto channel = flow.backward ? NoiseChannel::backward_outlier : NoiseChannel::outlier;
  const auto offset = flow.backward ? NoiseChannel::backward_outlier_offset : NoiseChannel::outlier_offset;
  std::vector<double> chance(pixels.size()), unused(pixels.size());
  context.draws.uniforms(channel, pixels, chance, unused);
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (chance[i] > options_.share) continue;
    const auto [a, b] = context.draws.uniforms(offset, pixels.frame, pixels.x[i], pixels.y[i]);
    flow.is_outlier[i] = 1;
    if (options_.shape == OutlierShape::box) {
      flow.u[i] += options_.radius_px * (2 * a - 1);
      flow.v[i] += options_.radius_px * (2 * b - 1);
    } else {
      const double radius_px = options_.radius_px * std::sqrt(a);
      const internal::SineCosine angle = internal::sine_cosine_turns(b);
      flow.u[i] += radius_px * angle.cosine;
      flow.v[i] += radius_px * angle.sine;
    }
  }
}

}  // namespace sextant
