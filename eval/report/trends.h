#pragma once

// How each body's error grows with the level of the noise, from records alone: one row per dataset, sequence,
// body and estimator of a sweep with at least two levels.
//
//   slope        least squares line of the error through all estimated pairs, per unit of the level; 95 %
//                interval by cluster bootstrap (clusters: seeds; with one seed frames)
//   relative     slope / mean error at the lowest level
//   p            Page's test that the clusters' means rise with the level, corrected by Holm over the table
//   rises        steps from level to level at which the mean over all rises / all steps
// Clusters that miss a level count in none of these.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/trend.h"

namespace sextant {

struct ErrorTrend {
  double mean_lowest = 0;   ///< of the error at the lowest level
  double mean_highest = 0;  ///< at the highest
  NoiseSlope slope;
  int n_rises = 0, n_steps = 0;
  std::optional<double> p;  ///< none with fewer than 2 clusters
  std::optional<double> p_corrected;
};

struct TrendRow {
  std::string parameter, dataset, sequence, body, estimator;
  double lowest = 0, highest = 0;  ///< level
  int n_levels = 0;
  int n_clusters = 0;
  std::map<std::string, ErrorTrend> errors;  ///< by name; the `compared` ones at two levels or more

  /// Whether the records of that level are behind this row.
  bool covers(const std::string& swept, const NoiseLevelKey& key) const {
    return swept == parameter && key.dataset == dataset && key.sequence == sequence && key.body == body &&
           key.estimator == estimator;
  }
};

/// In order of sweep, dataset, sequence, body (ego first), estimator.
std::vector<TrendRow> noise_trends(const std::vector<NoiseSweep>& sweeps, int jobs = 1,
                                   const BootstrapOptions& options = {});

Table trend_table(const std::vector<TrendRow>& rows);

}  // namespace sextant
