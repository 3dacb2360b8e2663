#pragma once

// A combination of noise models, applied to the points of a frame pair or to dense frames:
//
//   {"depth": {"delta_d_px": 0.2}, "flow": {"epe_x_px": 0.3, "epe_y_px": 0.2}, "correlation": "independent"}
//
// {} = none. Keys are the names of noise_models() and `correlation`; docs/noise.md explains them all.
//
// Points and dense frames get the same numbers: a point has the draw of its own pixel (the nearest, for
// points between pixels), and every changed number is rounded to float, as images store it. So corrupting
// points extracted from a frame, and reading the corrupted frame at their pixels, agree bit for bit.
//
//   depth       of the previous frame at the point's pixel: a point whose depth becomes invalid is dropped
//   depth_curr  of the current frame at the pixel nearest to p + clean flow; invalid = NaN. An estimator that
//               reads corrupted files looks it up at p + noisy flow instead
//   flow        of the previous frame at the point's pixel; for an outlier depth_curr becomes NaN, because it
//               would be looked up elsewhere
//   noise       what a sensor with this noise would declare, for every body that has points
//   masks       decide which points there are, so they must be corrupted before extraction: corrupt_mask()

#include <string>
#include <string_view>

#include "sextant/measurement/frame.h"
#include "sextant/measurement/problem.h"
#include "sextant/noise/noise_model.h"
#include "sextant/noise/verification.h"

namespace sextant {

struct NoisyPair {
  FramePair pair;
  NoiseVerification achieved;
};

struct NoisyFrame {
  Frame frame;
  NoiseVerification achieved;
};

class Noise {
 public:
  Noise() = default;
  /// Strict: throws Error on an unknown model or option, naming the nearest.
  explicit Noise(const Json& options);
  /// "none", "" or JSON text. Throws Error that shows where the text stops being JSON.
  static Noise parse(std::string_view text);

  /// Every model that changes something, with all its options: equal noise gives equal JSON.
  Json options() const;
  /// Short text for records: "depth 0.2 px + flow 0.3/0.2 px"; "none".
  std::string name() const;
  bool none() const { return models_.empty(); }

  bool changes_masks() const;
  /// This noise without its mask models: for points extracted from masks that are already corrupted.
  Noise without_masks() const;
  /// Its mask models alone.
  Noise only_masks() const;
  void corrupt_mask(Image<uint16_t>& mask) const;

  /// Throws Error when changes_masks().
  NoisyPair apply(const FramePair& pair, const Draws& draws) const;
  /// Depth, flow, backward flow and mask of one frame; what else is there stays. Noise that is not the same
  /// for all bodies needs the mask (Error); bodies are those of the mask before its corruption.
  NoisyFrame apply(const Frame& frame, const StereoCamera& camera, const Draws& draws) const;

  /// Sum of what the models ask for, as standard deviations.
  double depth_sigma_m(const StereoCamera& camera, double depth_m) const;
  FlowSigma flow_sigma(int body) const;
  /// What a sensor with this noise would declare for a body (instance id, 0 = background).
  MeasurementNoise declared(const StereoCamera& camera, int body) const;

 private:
  friend class NoiseApplication;
  struct NamedModel {
    std::string key;
    std::shared_ptr<const NoiseModel> model;
  };

  void declare(FramePair& pair) const;

  std::vector<NamedModel> models_;  ///< those that change something, in the order of noise_models()
  NoiseCorrelation correlation_;
};

/// Every option of every model, below "noise".
std::vector<OptionHelp> describe_noise_options();

}  // namespace sextant
