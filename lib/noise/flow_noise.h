#pragma once

// Gaussian flow noise, asked for by end-point error (EPE):
// phi' = phi + (sigma_x n1, sigma_y n2), n ~ N(0, 1).
//
//   reading           epe_x_px, epe_y_px (one axis)       epe_px (both axes alike)
//   epe_is_sigma      sigma_axis = EPE_axis                sigma = EPE                     the paper
//   epe_is_mean_error sigma_axis = EPE_axis sqrt(pi/2)     sigma = EPE / sqrt(pi/2)
//
// On one axis EPE is the mean absolute error, E|n| = sqrt(2/pi); in two dimensions it is the mean length of
// an isotropic Gaussian vector (Rayleigh), sqrt(pi/2) sigma. The factor is the same;
// it stands on opposite sides.
//
// `bodies` overrides the level of single bodies: "background", "objects" (all of them), "object:ID" (instance
// id). The paper's Table II gives each body its own.

#include <map>

#include "sextant/base/with_options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

/// Either epe_px, or epe_x_px and epe_y_px.
struct FlowLevel {
  SEXTANT_OPTIONS(
      (double, epe_px, 0, "px", "2-D end-point error, both axes alike"),
      (double, epe_x_px, 0, "px", "end-point error of the x axis"),
      (double, epe_y_px, 0, "px", "end-point error of the y axis"))
  void check() const;
};

enum class EpeReading { epe_is_sigma, epe_is_mean_error };
constexpr Names<2> names_of(EpeReading) { return {"epe_is_sigma", "epe_is_mean_error"}; }

struct FlowNoiseOptions {
  FlowLevel level;
  EpeReading reading = EpeReading::epe_is_sigma;
  double scale = 1;
  std::map<std::string, FlowLevel> bodies;
  void visit(auto& v) {
    level.visit(v);
    v("reading", reading, "", "of the end-point error; the paper's is the first");
    v("scale", scale, "1", "factor on every level, for sweeps");
    v("bodies", bodies, "", "levels of single bodies: background, objects, object:ID");
  }
  void check() const;
};

class FlowNoise : public WithOptions<NoiseModel, FlowNoiseOptions> {
 public:
  explicit FlowNoise(const FlowNoiseOptions& options);
  std::string name() const override;
  void corrupt_flow(const NoiseContext& context, const PixelBatch& pixels,
                    const FlowBatch& flow) const override;
  FlowSigma flow_sigma(int body) const override;
  bool changes_flow() const override;
  bool needs_bodies() const override { return changes_flow() && !options_.bodies.empty(); }

 private:
  FlowSigma sigma_of(const FlowLevel& level) const;

  std::map<int, FlowSigma> by_body_;  ///< "background" and "object:ID"
  FlowSigma of_objects_;              ///< all others with an id
  FlowSigma of_background_;
};

}  // namespace sextant
