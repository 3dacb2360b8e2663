#pragma once

// Errors by noise level, from records alone: one row per dataset, sequence, body, estimator and level.
//
//   mean, rmse, quantiles  over the estimated pairs of all seeds, each with its 95 % interval: cluster
//                          bootstrap with a seed's pairs as one cluster (stats/bootstrap.h); where there is
//                          one seed only, with frames as clusters
//   coverage               estimated pairs / pairs with truth; a body that is lost is not skipped silently
//
// A record whose body has no truth, or is static by truth, does not count.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/limit_summary.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

struct NoiseLevelRow {
  std::string parameter, dataset, sequence, body, estimator, noise;
  double level = 0;
  int n_seeds = 0;
  int n_truth = 0;
  int n_estimated = 0;
  std::map<std::string, SampleSummary> errors;  ///< by name; the `compared` ones that a record has
  LimitSummary limit;
  std::optional<double> epe_initial_px;  ///< mean: the noise that was really there, where true flow is given
};

/// In order of dataset, sequence, body (ego first), estimator, level, noise. The same for any `jobs`.
std::vector<NoiseLevelRow> noise_levels(const NoiseSweep& sweep, int jobs = 1,
                                        const BootstrapOptions& options = {});

Table noise_level_table(const std::vector<NoiseLevelRow>& rows);

}  // namespace sextant
