#pragma once

// Folders of runs and sweeps, as reports read them: the records by noise level, streamed, and the requested
// and achieved noise from run.json. Folders that vary the same noise parameter are joined, even if their
// estimators differ.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/report/noise_level.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// Noise of one source at one level, from run.json.
struct AchievedNoise {
  std::string source;
  double level = 0;
  Json noise;                    ///< NoiseVerification::json()
  std::filesystem::path file{};  ///< the run.json
};

/// Levels of one or several folders that vary the same parameter.
struct NoiseSweep {
  /// "depth.delta_d_px": key of the noise whose value is the level; "": none. Where the folders vary it under
  /// several kinds of other noise, "depth.delta_d_px with flow 0.3 px". "noise flow 0.3 px": no key, and the
  /// folders have one level of several kinds of noise, of which this sweep has one.
  std::string parameter;
  std::vector<NoiseLevelRef> levels;  ///< in order of key
  std::vector<Interned> estimators;   ///< in order of first appearance
  std::vector<AchievedNoise> achieved{};
};

/// A curve: one body of a sequence under one estimator, over the levels of a sweep. Rows of tables derive
/// from it.
struct CurveKey {
  std::string parameter;  ///< NoiseSweep::parameter; "" if nothing is swept
  std::string dataset, sequence, body, estimator;

  static CurveKey of(const std::string& parameter, const NoiseLevelKey& level);
  /// Returns true if the level `key`, in a sweep of the parameter `swept`, belongs to this curve.
  bool covers(const std::string& swept, const NoiseLevelKey& key) const;
  /// Returns the columns that identify a curve.
  static Fields<CurveKey> fields();
};

/// Adds the levels of `more` to `sweep`.
void add_levels(const NoiseSweep& more, NoiseSweep& sweep);

/// Reads folders; returns one sweep for each noise parameter that they vary and for each kind of other noise,
/// in order of parameter. Appends to `warnings`, unless null, where run.json states another number of
/// records, where shards of a sweep are missing, and if several versions of Sextant made the folders. Throws
/// Error on a folder without records.jsonl and summary.bin, on damaged files, if a case occurs twice, if
/// folders define an error differently, and if records of one row differ in more than the seed.
std::vector<NoiseSweep> read_noise_sweeps(const std::vector<std::filesystem::path>& folders,
                                          std::vector<std::string>* warnings = nullptr);

/// Returns true if errors are expected to grow with the level: false for a stereo baseline, for example.
bool increases_noise(const std::string& parameter);

/// Returns the title of an axis for the parameter: "flow noise: standard deviation of x and y [px]". `noise`:
/// its name in the records of one level.
std::string parameter_title(const std::string& parameter, const std::string& noise);

}  // namespace sextant
