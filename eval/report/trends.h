#pragma once

// Growth of each body's error with the noise level, from records only: one row per data set, sequence, body
// and estimator of a sweep with at least two levels.
//
//   slope        slope of the least-squares line of the error through all estimated pairs, per unit of the
//                level; 95 % interval by cluster bootstrap (clusters: seeds; with one seed: frames)
//   relative     slope / mean error at the lowest level
//   p            Page's test that the means of the clusters rise with the level, corrected by Holm over the
//                table
//   rises        number of steps between levels at which the mean over all clusters rises / all steps
//
// Clusters that lack a level are left out.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/trend.h"

namespace sextant {

/// Trend of one error.
struct ErrorTrend {
  double mean_lowest = 0;   ///< mean error at the lowest level
  double mean_highest = 0;  ///< mean error at the highest level
  NoiseSlope slope;
  int n_rises = 0, n_steps = 0;
  std::optional<double> p;  ///< empty with fewer than 2 clusters
  std::optional<double> p_corrected;
};

struct TrendRow : CurveKey {
  double lowest = 0, highest = 0;  ///< level
  int n_levels = 0;
  int n_clusters = 0;
  std::map<std::string, ErrorTrend> errors;  ///< by name; the `compared` errors known at two levels or more
};

/// Returns rows in order of sweep, data set, sequence, body (camera first) and estimator.
std::vector<TrendRow> noise_trends(const std::vector<NoiseSweep>& sweeps, int jobs = 1,
                                   const BootstrapOptions& options = {});

Table trend_table(const std::vector<TrendRow>& rows);

// ---- Errors that fall from the lowest to the highest level of noise, with the reason as far as records show
// it. The mean over all estimated pairs may fall although the estimator does not become better: under more
// noise fewer pairs are estimated, and the difficult ones are missing first. The pairs estimated at both
// levels decide:
//
//   coverage   on these pairs the error does not fall
//   selection  it falls on these pairs as well: the estimate is made of other points, or the fall is chance

struct FallingError : CurveKey {
  double lowest = 0, highest = 0;  ///< levels
  struct Mean {
    size_t n = 0;  ///< pairs
    double lowest = 0, highest = 0;
  };
  Mean Et_m;  ///< over all estimated pairs; n: those at the highest level
  size_t n_lowest = 0;
  std::optional<Mean> common_Et_m;  ///< over pairs estimated at both levels; absent if not known

  std::string reason() const;
};

/// An error falls if its mean at the highest level is lower than this share of its mean at the lowest level.
inline constexpr double least_fall = 0.95;
/// Returns the curves whose mean E_t falls.
std::vector<FallingError> falling_errors(const std::vector<NoiseSweep>& sweeps);

Table falling_error_table(const std::vector<FallingError>& rows);

}  // namespace sextant
