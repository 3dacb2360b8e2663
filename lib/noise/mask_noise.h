#pragma once

// Masks that are too small or too large by n px. One step of
//
//   erosion   takes away every instance pixel with a neighbour of another id (background or instance);
//   dilation  gives every background pixel with instance neighbours the smallest of their ids.
//
// Neighbours: 4 (edges; n steps reach |dx| + |dy| <= n) or 8 (edges and corners; max(|dx|, |dy|) <= n).
// Outside the image there are no neighbours: an instance cut by the border does not shrink there.
// With both, erosion comes first (an opening). Nothing is drawn: the outcome does not depend on the seed.

#include "sextant/base/with_options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

struct MaskNoiseOptions {
  SEXTANT_OPTIONS(
      (int, erode_px, 0, "px", "steps of erosion"),
      (int, dilate_px, 0, "px", "steps of dilation, after erosion"),
      (int, neighbours, 4, "4 or 8", "of a pixel"))
  void check() const;
};

class MaskNoise : public WithOptions<NoiseModel, MaskNoiseOptions> {
 public:
  explicit MaskNoise(const MaskNoiseOptions& options) : WithOptions(options) {}
  std::string name() const override;
  void corrupt_mask(Image<uint16_t>& mask) const override;
  bool changes_masks() const override { return options_.erode_px > 0 || options_.dilate_px > 0; }
};

}  // namespace sextant
