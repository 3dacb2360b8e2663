#pragma once

// A noise profile: statistics of the errors of a source's flow and disparity, and the noise (docs/noise.md)
// with the same magnitude, tails and correlation. `sextant noise fit` writes it; `"noise": {"profile": NAME}`
// injects it.
//
//   {"schema": 1, "name": "pwc_net_kitti03", "source": "vdo:kitti_03_demo@0-19", ...,
//    "noise": {"flow": {"epe_x_px", "epe_y_px"}, "outliers": {"share", "radius_px"},
//              "depth": {"delta_d_px", "baseline_m": 0}, "correlation": {"model": "spatial", ...}},
//    "flow": {"reference", "n_frames", "n", "offset_px", "sigma_px", "mean_abs_px", "mean_px", "tail_share",
//             "tail_radius_px", "spatial": {"model", "lengths_px", "shares"} or "independent",
//             "correlation": [{"low_px", "high_px", "distance_px", "n", "value", "interval", "injected"}],
//             "dependence": [{"on", "low", "high", "n", "sigma_px", "tail_share"}]},
//    "disparity": {... as for flow, with one axis}}
//
// Noise has one correlation for all channels: that of the flow, if there is one. Offsets are reported, not
// injected. `injected` is the correlation of noise drawn with these lengths and shares, measured at the same
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
  Noise noise;       ///< added to the source before measuring
  uint64_t seed = 0;
  DepthReference depth = DepthReference::none;  ///< none: the best available
  int max_frames = 40;                          ///< evenly spaced; more frames add little information
  int jobs = 1;
  std::string data_root{};  ///< removed from paths in the provenance, since profiles are passed on
};

struct ProfileChannel {
  std::string reference;
  ChannelErrors errors;
  std::vector<double> injected;  ///< correlation of injected noise, per bin of errors.correlation
};

struct NoiseProfile {
  std::string name;
  Json provenance;
  std::optional<ProfileChannel> flow, disparity;

  /// Returns the noise in the form of the noise option.
  Json noise() const;
  /// Returns the correlation of injected noise, which all channels share: that of the flow or, if only the
  /// disparity was measured, of the disparity.
  const SpatialCorrelation& injected_correlation() const;
  /// Returns why injected noise differs from the measured errors: the core is not Gaussian, because tails
  /// overlap it, or most errors are tails.
  std::vector<std::string> warnings() const;
  Json json() const;
};

/// Measures the errors of `sequence` and fits the profile; `source` is the name of the sequence in provenance
/// and messages. Throws Error if neither flow nor disparity has measurable errors.
NoiseProfile fit_noise_profile(const Sequence& sequence, const std::string& source,
                               const ProfileOptions& options);

/// Fits the profile of `source`, writes it to the JSON file `out`, and its figure into the folder `figure`
/// (empty: no figure). An empty name is replaced by that of `out` without its extension.
NoiseProfile write_noise_profile(const SourceSpec& source, ProfileOptions options,
                                 const std::filesystem::path& out, const std::string& figure);

/// Returns the figure of measured and injected correlation, one panel per channel.
Figure profile_figure(const NoiseProfile& profile);

/// Returns the table of magnitude, tails and correlation, one line per channel.
Table profile_table(const NoiseProfile& profile);

}  // namespace sextant
