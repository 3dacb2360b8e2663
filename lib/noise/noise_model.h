#pragma once

// Interface of all noise models, and the table of the existing ones. To add one:
//   1. write lib/noise/<name>.{h,cc}: an options struct (base/options.h) and a class derived from NoiseModel;
//   2. add one line to the table in registry.cc.
// The parametrised test in registry_test.cc then covers it.
//
// A model changes arrays of measurements in place; noise.h applies the models, in the order of the table, to
// points and to dense frames. Invalid entries (not finite; depth not positive) are not measurements: values
// that a model writes to them are discarded.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/geometry/camera.h"
#include "sextant/measurement/image.h"
#include "sextant/noise/draws.h"

namespace sextant {

/// Input of a model besides the measurements.
struct NoiseContext {
  const Draws& draws;
  const NoiseCorrelation& correlation;
  StereoCamera camera;

  void normals(NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
               std::span<double> second) const {
    correlation.normals(draws, channel, pixels, first, second);
  }
};

/// Flow of the pixels of a batch, px; arrays with the length of the batch.
struct FlowBatch {
  bool backward = false;      ///< flow to the previous frame instead of the next one
  std::span<const int> body;  ///< instance id of each pixel; 0 = background
  std::span<double> u;
  std::span<double> v;
  std::span<unsigned char> is_outlier;  ///< models set 1 where they make the flow an outlier
};

/// Standard deviations of flow noise per axis, px.
struct FlowSigma {
  double x_px = 0;
  double y_px = 0;
};

class NoiseModel {
 public:
  virtual ~NoiseModel() = default;

  /// Returns all options with their values, for provenance.
  virtual Json options() const = 0;
  /// Returns a short text for records, "depth 0.2 px"; empty if the model has no effect.
  virtual std::string name() const = 0;

  /// Corrupts depths (m) in place. Results that are not positive or not finite are invalid.
  virtual void corrupt_depth(const NoiseContext&, const PixelBatch&, std::span<double> /*depth_m*/) const {}
  virtual void corrupt_flow(const NoiseContext&, const PixelBatch&, const FlowBatch&) const {}
  virtual void corrupt_mask(Image<uint16_t>&) const {}

  /// Return the standard deviations of the Gaussian noise of this model; 0 if it adds none.
  virtual double depth_sigma_m(const StereoCamera&, double /*depth_m*/) const { return 0; }
  virtual FlowSigma flow_sigma(int /*body*/) const { return {}; }
  virtual double outlier_share() const { return 0; }
  /// Returns the standard deviation of a rounding error, which is not Gaussian.
  virtual double depth_rounding_sigma_m(const StereoCamera&, double /*depth_m*/) const { return 0; }
  virtual bool changes_depth() const { return false; }
  virtual bool changes_flow() const { return false; }
  virtual bool changes_masks() const { return false; }
  /// Returns true if the flow noise differs between bodies, so that a dense frame requires its mask.
  virtual bool needs_bodies() const { return false; }
};

struct NoiseModelEntry {
  std::string name;  ///< key in the noise options
  std::string description;
  std::function<std::unique_ptr<NoiseModel>(const Json& options)> make;  ///< strict options, {} = defaults
  std::function<std::vector<OptionHelp>()> options;
};

/// Returns all models in the order in which they are applied.
std::span<const NoiseModelEntry> noise_models();

}  // namespace sextant
