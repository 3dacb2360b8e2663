#pragma once

// The interface of all noise models and the table of those that exist. How to add one:
//   1. write lib/noise/<name>.{h,cc}: an options struct (base/options.h) and a class derived from NoiseModel;
//   2. add one line to the table in registry.cc.
// The parametrised test in registry_test.cc then runs over it.
//
// A model changes arrays of measurements in place; noise.h applies the models, in the order of the table, to
// points and to dense frames. Entries that are not valid (NaN; depth not above 0) are not measurements:
// whatever a model writes there is thrown away.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/geometry/camera.h"
#include "sextant/measurement/image.h"
#include "sextant/noise/noise_correlation.h"

namespace sextant {

/// What a model may know besides the measurement.
struct NoiseContext {
  const Draws& draws;
  const NoiseCorrelation& correlation;
  StereoCamera camera;

  void normals(NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
               std::span<double> second) const {
    correlation.normals(draws, channel, pixels, first, second);
  }
};

/// Flow of the pixels of a batch, px; arrays of its length.
struct FlowBatch {
  bool backward = false;      ///< to the previous frame instead of to the next
  std::span<const int> body;  ///< instance id of each pixel; 0 = background
  std::span<double> u;
  std::span<double> v;
  std::span<unsigned char> is_outlier;  ///< set where the flow has been made wrong on purpose
};

/// Standard deviation of flow noise by axis, px.
struct FlowSigma {
  double x_px = 0;
  double y_px = 0;
};

class NoiseModel {
 public:
  virtual ~NoiseModel() = default;

  /// All options with their values, for provenance.
  virtual Json options() const = 0;
  /// Short text for records, "depth 0.2 px"; empty when the options make the model change nothing.
  virtual std::string name() const = 0;

  /// Depths in m. Not above 0 or not finite afterwards: invalid.
  virtual void corrupt_depth(const NoiseContext&, const PixelBatch&, std::span<double> /*depth_m*/) const {}
  virtual void corrupt_flow(const NoiseContext&, const PixelBatch&, const FlowBatch&) const {}
  virtual void corrupt_mask(Image<uint16_t>&) const {}

  /// What the options ask for; 0 where the model adds no Gaussian noise.
  virtual double depth_sigma_m(const StereoCamera&, double /*depth_m*/) const { return 0; }
  virtual FlowSigma flow_sigma(int /*body*/) const { return {}; }
  virtual double outlier_share() const { return 0; }
  /// Standard deviation of a rounding error, which is not Gaussian.
  virtual double depth_rounding_sigma_m(const StereoCamera&, double /*depth_m*/) const { return 0; }
  virtual bool changes_depth() const { return false; }
  virtual bool changes_flow() const { return false; }
  virtual bool changes_masks() const { return false; }
  /// The flow noise is not the same for all bodies: a dense frame needs its mask.
  virtual bool needs_bodies() const { return false; }
};

struct NoiseModelEntry {
  std::string name;  ///< key in the options
  std::string description;
  std::function<std::unique_ptr<NoiseModel>(const Json& options)> make;  ///< strict options, {} = defaults
  std::function<std::vector<OptionHelp>()> options;
};

/// In the order in which they are applied.
std::span<const NoiseModelEntry> noise_models();

}  // namespace sextant
