#pragma once

// Requested and achieved noise, from the run.json of runs and sweeps: one row per source, level and
// channel. The statistics are over the draws that every estimator used.
//
//   depth      delta_d [px]: standard deviation of the depth error times f b / z^2
//   flow x, y  standard deviation [px], per body;   flow EPE: mean length of the error vector [px], per body
//   neighbours correlation between horizontally neighbouring pixels

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct AchievedNoiseRow {
  std::string parameter, source, body, channel;
  std::filesystem::path file{};  ///< the run.json that records it
  double level = 0;
  std::optional<double> requested_px;  ///< none where only quantisation or outliers are requested
  std::optional<double> achieved_px;
  double n = 0;  ///< number of draws
  std::optional<double> neighbours;
  std::optional<double> share_invalidated;  ///< depth only
  std::optional<double> outlier_share;      ///< flow only
};

std::vector<AchievedNoiseRow> achieved_noise_rows(const NoiseSweep& sweep);

Table achieved_noise_table(const std::vector<AchievedNoiseRow>& rows);

}  // namespace sextant
