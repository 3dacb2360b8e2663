#pragma once

// Depth noise of a stereo camera with disparity accuracy delta_d (paper sec. V; docs/noise.md):
//
//   z' = z + sigma(z) n,   sigma(z) = z^2 / (f b) delta_d,   n ~ N(0, 1)
//
// f = fx of the camera (px), b = baseline. z' <= 0 is invalid and is never clamped.

#include <map>

#include "sextant/base/options.h"
#include "sextant/noise/noise_model.h"

namespace sextant {

/// Returns f b in px m: fx * baseline_m, or the source's own bf if baseline_m is 0. Throws Error if that is
/// not positive.
double focal_baseline(const StereoCamera& camera, double baseline_m);

struct DepthNoiseOptions {
  SEXTANT_OPTIONS((double, delta_d_px, 0, "px",
                   "disparity accuracy; 0.1 to 0.2 is typical of industrial stereo cameras"),
                  (double, baseline_m, 0.5, "m",
                   "baseline of the assumed stereo camera (paper: 0.5); 0 = the source's own bf"))
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

// Gaussian flow noise, specified by its end-point error (EPE):
// phi' = phi + (sigma_x n1, sigma_y n2), n ~ N(0, 1).
//
//   reading           epe_x_px, epe_y_px (one axis)       epe_px (both axes alike)
//   epe_is_sigma      sigma_axis = EPE_axis                sigma = EPE                     the paper
//   epe_is_mean_error sigma_axis = EPE_axis sqrt(pi/2)     sigma = EPE / sqrt(pi/2)
//
// On one axis EPE is the mean absolute error, E|n| = sqrt(2/pi) sigma; in two dimensions it is the mean
// length of an isotropic Gaussian vector (Rayleigh), sqrt(pi/2) sigma. The same factor therefore multiplies
// in one case and divides in the other.
//
// `bodies` overrides the level of single bodies: "background", "objects" (all of them), "object:ID" (instance
// id), since the paper's Table II gives a level per body.

/// Noise level: either epe_px, or epe_x_px and epe_y_px.
struct FlowLevel {
  SEXTANT_OPTIONS((double, epe_px, 0, "px", "2-D end-point error, equal on both axes"),
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
    v("reading", reading, "", "how the end-point error defines sigma; the first is the paper's");
    v("scale", scale, "1", "factor on all levels, for sweeps");
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
  FlowSigma of_objects_;              ///< all other objects
  FlowSigma of_background_;
};

// A share of wrong flows: the flow of an outlier is shifted by an offset that is uniform over a disc or a
// box,
//
//   disc   |offset| <= radius_px           box   |offset_x|, |offset_y| <= radius_px
//
// Outliers are independent between pixels with every `correlation`, which applies to normals only. Small
// offsets occur by chance: a share of (t / radius_px)^2 of a disc's outliers has an offset of at most t px.

enum class OutlierShape { disc, box };
constexpr Names<2> names_of(OutlierShape) { return {"disc", "box"}; }

struct FlowOutlierOptions {
  SEXTANT_OPTIONS((double, share, 0, "0..1", "probability that the flow of a pixel is wrong"),
                  (double, radius_px, 50, "px",
                   "largest offset: radius of the disc, half the side of the box"),
                  (OutlierShape, shape, OutlierShape::disc, "", "shape of the area of the offsets"))
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

// Instance masks that are too small or too large by n px, from n steps of erosion or dilation. One step of
//
//   erosion   removes every instance pixel with a neighbour of another id (background or instance);
//   dilation  gives every background pixel with instance neighbours the smallest of their ids.
//
// Neighbours: 4 (edges; n steps reach |dx| + |dy| <= n) or 8 (edges and corners; max(|dx|, |dy|) <= n).
// Pixels have no neighbours outside the image: an instance cut by the border does not shrink there. If both
// are given, erosion comes first (an opening). The result does not depend on the seed.

struct MaskNoiseOptions {
  SEXTANT_OPTIONS((int, erode_px, 0, "px", "steps of erosion"),
                  (int, dilate_px, 0, "px", "steps of dilation, after erosion"),
                  (int, neighbours, 4, "4 or 8", "neighbourhood of a pixel"))
  void check() const;
};

class MaskNoise : public WithOptions<NoiseModel, MaskNoiseOptions> {
 public:
  explicit MaskNoise(const MaskNoiseOptions& options) : WithOptions(options) {}
  std::string name() const override;
  void corrupt_mask(Image<uint16_t>& mask) const override;
  bool changes_masks() const override { return options_.erode_px > 0 || options_.dilate_px > 0; }
};

// Depth computed from a disparity image of finite resolution:
//
//   d = f b / z,   z' = f b / (step * round(d / step))
//
// A disparity that rounds to 0 gives no depth (invalid).

struct QuantisationOptions {
  SEXTANT_OPTIONS((double, step_px, 0, "px", "resolution of disparity; 0 = none (KITTI files: 0.00390625)"),
                  (double, baseline_m, 0, "m",
                   "baseline of the assumed stereo camera; 0 = the source's own bf"))
  void check() const;
};

class Quantisation : public WithOptions<NoiseModel, QuantisationOptions> {
 public:
  explicit Quantisation(const QuantisationOptions& options) : WithOptions(options) {}
  std::string name() const override;
  void corrupt_depth(const NoiseContext& context, const PixelBatch& pixels,
                     std::span<double> depth_m) const override;
  /// Returns the standard deviation of the depth for a uniform disparity error of one step, whose standard
  /// deviation is step / sqrt(12).
  double depth_rounding_sigma_m(const StereoCamera& camera, double depth_m) const override;
  bool changes_depth() const override { return options_.step_px > 0; }
};

}  // namespace sextant
