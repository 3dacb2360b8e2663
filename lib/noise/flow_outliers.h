#pragma once

// A share of wrong flows: an outlier's flow is moved by an offset that is uniform over a disc or box,
//
//   disc   |offset| <= radius_px           box   |offset_x|, |offset_y| <= radius_px
//
// Each pixel is drawn by itself, also with correlation shared_per_frame, which concerns normals. An offset
// may be small by chance: a share of (t / radius)^2 of a disc's outliers lies within t px.

#include "sextant/base/with_options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

enum class OutlierShape { disc, box };
constexpr Names<2> names_of(OutlierShape) { return {"disc", "box"}; }

struct FlowOutlierOptions {
  SEXTANT_OPTIONS(
      (double, share, 0, "0..1", "probability that the flow of a pixel is wrong"),
      (double, radius_px, 50, "px", "largest offset: radius of the disc, half the side of the box"),
      (OutlierShape, shape, OutlierShape::disc, "", "of the area that offsets are spread over"))
  void check() const;
};

class FlowOutliers : public WithOptions<NoiseModel, FlowOutlierOptions> {
 public:
  explicit FlowOutliers(const FlowOutlierOptions& options) : WithOptions(options) {}
  std::string name() const override;
  void corrupt_flow(const NoiseContext& context, const PixelBatch& pixels,
                    const FlowBatch& flow) const override;
  double outlier_share() const override { return options_.share; }
  bool changes_flow() const override { return options_.share > 0; }
};

}  // namespace sextant
