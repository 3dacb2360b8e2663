#pragma once

// A combination of noise models, applied to the points of a frame pair or to dense frames:
//
//   {"depth": {"delta_d_px": 0.2}, "flow": {"epe_x_px": 0.3, "epe_y_px": 0.2}, "correlation": "independent"}
//
// {} = none. Keys are the names of noise_models() and `correlation`, or `profile` and `scale`
// (stored_profiles.h); docs/noise.md explains them all.
//
// Points and dense frames get the same noise: a point uses the draw of its pixel (the nearest pixel, for
// points between pixels), and every changed number is rounded to float, as images store it. Corrupting points
// extracted from a frame, and extracting points from the corrupted frame at the same pixels, agree bit for
// bit.
//
//   depth       of the previous frame at the point's pixel: a point whose depth becomes invalid is dropped
//   depth_curr  of the current frame at the pixel nearest to p + clean flow; invalid = NaN. An estimator that
//               reads corrupted files looks this depth up at p + noisy flow instead
//   flow        of the previous frame at the point's pixel. For an outlier depth_curr becomes NaN, because
//               the wrong flow leads to another pixel
//   noise       the noise that a sensor would declare, for the background and every object that has points
//   masks       determine which points exist, so they must be corrupted before extraction: corrupt_mask()

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
  /// Reads options strictly: throws Error for an unknown model or option, which also names the nearest known
  /// one, and for invalid values.
  explicit Noise(const Json& options);
  /// Parses JSON text; "none" and "" give no noise. Throws Error, for invalid JSON with the position.
  static Noise parse(std::string_view text);

  /// Returns all options of the models that have an effect: equal noise gives equal JSON.
  Json options() const;
  /// Returns a short text for records: "depth 0.2 px + flow 0.3/0.2 px"; "none".
  std::string name() const;
  bool none() const { return models_.empty(); }

  bool changes_masks() const;
  /// Returns this noise without its mask models, for points extracted from masks that are already corrupted.
  Noise without_masks() const;
  /// Returns this noise with its mask models alone.
  Noise only_masks() const;
  void corrupt_mask(Image<uint16_t>& mask) const;

  /// Applies the noise to the points of a frame pair; throws Error if changes_masks().
  NoisyPair apply(const FramePair& pair, const Draws& draws) const;
  /// Applies the noise to depth, flow, backward flow and mask of one frame; other channels stay unchanged.
  /// Throws Error if the flow noise differs between bodies and a frame with flow has no mask. Bodies are the
  /// ids of the corrupted mask, as in the points that are extracted from corrupted frames.
  NoisyFrame apply(const Frame& frame, const StereoCamera& camera, const Draws& draws) const;

  /// Return the standard deviation of the Gaussian noise of all models together, without rounding and
  /// outliers.
  double depth_sigma_m(const StereoCamera& camera, double depth_m) const;
  FlowSigma flow_sigma(int body) const;
  /// Returns a warning if the depth noise is that of a stereo baseline that differs from the camera's by more
  /// than a fifth; an empty text otherwise, and for a camera without a baseline.
  std::string baseline_warning(const StereoCamera& camera) const;
  /// Returns the noise that a sensor would declare for a body (instance id, 0 = background).
  MeasurementNoise declared(const StereoCamera& camera, int body) const;

 private:
  friend class NoiseApplication;
  struct NamedModel {
    std::string key;
    std::shared_ptr<const NoiseModel> model;
  };

  void declare(FramePair& pair) const;

  std::vector<NamedModel> models_;  ///< the models that have an effect, in the order of noise_models()
  NoiseCorrelation correlation_;
};

/// Returns every option of every model, with keys below "noise".
std::vector<OptionHelp> describe_noise_options();

}  // namespace sextant
