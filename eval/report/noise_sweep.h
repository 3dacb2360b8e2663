#pragma once

// Folders of runs and sweeps as reports read them: the records by level of the noise, streamed, and of
// run.json what was asked of the noise and what came out. Folders that vary the same parameter of the noise
// belong together, whichever estimator they hold.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/report/noise_level.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// Noise of one source at one level, of run.json.
struct AchievedNoise {
  std::string source;
  double level = 0;
  Json noise;  ///< NoiseVerification::json()
  std::filesystem::path file{};  ///< the run.json
};

struct NoiseSweep {
  std::string parameter;  ///< "depth.delta_d_px": the key of the noise whose value is the level; "" = none
  std::vector<NoiseLevelRef> levels;  ///< in order of key
  std::vector<Interned> estimators;   ///< in order of first appearance
  std::vector<AchievedNoise> achieved{};

  size_t n_levels() const;
};

/// Of these records alone.
NoiseSweep noise_sweep_of(const std::string& parameter, const std::vector<Record>& records);
/// With the levels of `more` too.
void add_levels(const NoiseSweep& more, NoiseSweep& sweep);

/// In order of parameter; within one, in the order of the folders. Throws Error for a folder without
/// records.jsonl or summary.bin, and for the same case (all of a record's keys) in two folders.
std::vector<NoiseSweep> read_noise_sweeps(const std::vector<std::filesystem::path>& folders);

/// The dotted key of the noise that has the value of the level at every level of a run.json's configuration;
/// "" where there is none, or only one level.
std::string swept_parameter(const Json& configuration);

/// An axis of that parameter: "disparity noise delta_d [px]".
std::string parameter_title(const std::string& parameter);

// ---- What was asked of the noise and what came out, from the run.json of runs and sweeps: one row per
// source, level and channel. The draws that every estimator saw are those counted here.
//
//   depth      delta_d [px]: standard deviation of the depth error times f b / z^2
//   flow x, y  standard deviation [px], per body;   flow EPE: mean length of the error vector [px], per body
//   neighbours correlation between horizontally neighbouring pixels

struct AchievedNoiseRow {
  std::string parameter, source, body, channel;
  std::filesystem::path file{};  ///< the run.json that says so
  double level = 0;
  double requested_px = 0;
  double achieved_px = 0;
  double n = 0;  ///< draws
  std::optional<double> neighbours;
  std::optional<double> share_invalidated;  ///< depth only
  std::optional<double> outlier_share;      ///< flow only
};

std::vector<AchievedNoiseRow> achieved_noise_rows(const NoiseSweep& sweep);

Table achieved_noise_table(const std::vector<AchievedNoiseRow>& rows);

}  // namespace sextant
