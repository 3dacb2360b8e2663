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

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

// ---- How near the estimates of one noise level come to the limit (docs/metrics.md, "The Cramér-Rao bound"):
//
//   bound        RMS of the records' bounds
//   efficiency   bound / RMS of the errors of the same records; its interval from the bootstrap of that RMS
//   ANEES        mean of the records' NEES, and where that of a consistent estimator lies (stats/trend.h)

struct Efficiency {
  double bound = 0;  ///< unit of the error
  double efficiency = 0;
  std::optional<Interval> interval;  ///< of the efficiency, 95 %; none with one seed
};

struct Consistency {
  double anees = 0;
  Interval expected;  ///< 95 %
  int n = 0;
};

struct LimitSummary {
  std::map<std::string, Efficiency> efficiency;  ///< by error; those of bounded_errors() that records have
  std::optional<Consistency> consistency;
};

/// The compared errors that have a bound.
std::vector<const MetricDefinition*> bounded_errors();

/// Of the estimated records of one body, estimator and level. What no record has is none.
LimitSummary summarize_limit(const NoiseLevel& level, const BootstrapOptions& options);

/// The columns of a noise table that say how near its errors come to the bound.
Fields<LimitSummary> limit_fields();

// ---- errors

struct NoiseLevelRow {
  std::string parameter, dataset, sequence, body, estimator, noise;
  double level = 0;
  int n_seeds = 0;
  int n_truth = 0;
  int n_estimated = 0;
  std::map<std::string, SampleSummary> errors;  ///< by name; the `compared` ones that a record has
  LimitSummary limit;
  std::optional<double> epe_initial_px;  ///< mean: the noise that was really there, where true flow is given

  /// Whether the records of that level are behind this row.
  bool covers(const std::string& swept, const NoiseLevelKey& key) const {
    return swept == parameter && key.dataset == dataset && key.sequence == sequence && key.body == body &&
           key.estimator == estimator && key.level == level && key.noise == noise;
  }
};

/// In order of dataset, sequence, body (ego first), estimator, level, noise. The same for any `jobs`.
std::vector<NoiseLevelRow> noise_levels(const NoiseSweep& sweep, int jobs = 1,
                                        const BootstrapOptions& options = {});

Table noise_level_table(const std::vector<NoiseLevelRow>& rows);

}  // namespace sextant
