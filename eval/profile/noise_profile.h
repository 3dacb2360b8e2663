#pragma once

// A noise profile: what the errors of a source's flow and disparity look like, as numbers, and the noise
// (docs/noise.md) that has the same size, tails and correlation. `sextant noise fit` writes it, `"noise":
// {"profile": NAME}` injects it.
//
//   {"schema": 1, "name": "pwc_net_kitti03", "source": "vdo:kitti_03_demo@0-19", ...,
//    "noise": {"flow": {"epe_x_px", "epe_y_px"}, "outliers": {"share", "radius_px"},
//              "depth": {"delta_d_px", "baseline_m": 0}, "correlation": {"model": "spatial", ...}},
//    "flow": {"reference", "n_frames", "n", "offset_px", "sigma_px", "mean_abs_px", "mean_px", "tail_share",
//             "tail_radius_px", "correlation": [{"low_px", "high_px", "distance_px", "n", "value",
//             "interval", "injected"}], "lengths_px", "shares", "dependence": [{"on", "low", "high", "n",
//             "sigma_px", "tail_share"}]},
//    "disparity": {... the same, one axis}}
//
// Noise has one correlation for all channels: that of the flow, where there is one. Offsets are told, not
// injected. `injected` is the correlation of drawn noise with these lengths and shares, measured at the same
// pixels.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/profile/channel_errors.h"
#include "sextant/eval/profile/error_fields.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

struct ProfileOptions {
  std::string name;  ///< letters, digits, '_', '-', '.'
  Noise noise;       ///< added to the source first
  uint64_t seed = 0;
  DepthReference depth = DepthReference::none;  ///< none: as available
  int max_frames = 40;                          ///< evenly spread; more say little more
  int jobs = 1;
  std::string data_root{};  ///< profiles are passed on: paths in their provenance begin below it
};

struct ProfileChannel {
  std::string reference;
  ChannelErrors errors;
  std::vector<double> injected;  ///< per bin of errors.correlation
};

struct NoiseProfile {
  std::string name;
  Json provenance;
  std::optional<ProfileChannel> flow, disparity;

  /// As the noise option takes it.
  Json noise() const;
  Json json() const;
};

/// Throws Error when nothing can be measured.
NoiseProfile fit_noise_profile(const Sequence& sequence, const std::string& source,
                               const ProfileOptions& options);

/// The profile of `source`, written to the JSON file `out`, and its figure into the folder `figure` (empty:
/// no figure). An empty name is that of `out`.
NoiseProfile write_noise_profile(const SourceSpec& source, ProfileOptions options,
                                 const std::filesystem::path& out, const std::string& figure);

/// Measured and injected correlation, one panel a channel.
Figure profile_figure(const NoiseProfile& profile);

/// Size, tails and correlation, one line a channel.
Table profile_table(const NoiseProfile& profile);

}  // namespace sextant
