#pragma once

// Errors by noise level, from records alone: one row per dataset, sequence, body, estimator and level.
//
//   mean, median, rmse   over the estimated pairs of all seeds
//   interval             95 % of the mean, cluster bootstrap with a seed's pairs as one cluster
//   (stats/bootstrap.h);
//                        none with one seed
//   coverage             estimated pairs / pairs with truth; a body that is lost is not skipped silently
//
// A record whose body has no truth, or is static by truth, does not count.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/experiment/record.h"
#include "sextant/eval/report/limit_summary.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct ErrorSummary {
  double mean = 0;
  double median = 0;
  double rmse = 0;
  std::optional<Interval> interval;  ///< of the mean
};

struct NoiseLevelRow {
  std::string dataset, sequence, body, estimator, noise;
  double level = 0;
  int n_seeds = 0;
  int n_truth = 0;
  int n_estimated = 0;
  std::optional<ErrorSummary> Et_m;
  std::optional<ErrorSummary> ER_deg;
  LimitSummary limit;
  std::optional<double> epe_initial_px;  ///< mean: the noise that was really there, where true flow is given
};

/// In order of dataset, sequence, body (ego first), estimator, level, noise.
std::vector<NoiseLevelRow> noise_levels(const std::vector<Record>& records,
                                        const BootstrapOptions& options = {});

Table noise_level_table(const std::vector<NoiseLevelRow>& rows);

}  // namespace sextant
