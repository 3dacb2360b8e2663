#pragma once

// Errors by noise level, from records only: one row per data set, sequence, body, estimator and level.
//
//   mean, rmse, quantiles  over the estimated pairs of all seeds, with 95 % intervals by the cluster
//                          bootstrap (stats/bootstrap.h); a cluster is the pairs of a seed, or a frame if
//                          there is one seed
//   coverage               estimated pairs / pairs with truth, so that a lost body lowers it
//
// Records of bodies without truth, or static by truth, are not counted.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

// ---- Ratio of the errors at one noise level to the Cramer-Rao bound (docs/metrics.md, "The Cramér-Rao
// bound"):
//
//   bound        RMS of the bounds of the records
//   efficiency   bound / RMS error of the same records; its interval follows from the bootstrap of that RMS
//   ANEES        mean NEES of the records, with the interval expected for a consistent estimator
//                (stats/trend.h)

/// Efficiency of one error.
struct Efficiency {
  double bound = 0;  ///< unit of the error
  double efficiency = 0;
  std::optional<Interval> interval;  ///< 95 % interval of the efficiency; nullopt with one seed

  /// RMS error / bound, which is 1 at the bound.
  IntervalEstimate ratio() const;
};

/// ANEES of one body.
struct Consistency {
  double anees = 0;
  Interval expected;  ///< 95 %
  int n = 0;
};

/// Bounds and consistency of one noise level.
struct LimitSummary {
  std::map<std::string, Efficiency> efficiency;  ///< by error; the bounded_errors() that the records have
  std::optional<Consistency> consistency;
};

/// Returns the compared errors that have a bound.
std::vector<const MetricDefinition*> bounded_errors();

/// Summarises the estimated records of one body, estimator and level; values that no record has stay empty.
LimitSummary summarize_limit(const NoiseLevel& level, const BootstrapOptions& options);

/// Columns of a noise table for efficiency and consistency.
Fields<LimitSummary> limit_fields();

// ---- errors

/// One row of the noise table.
struct NoiseLevelRow : CurveKey {
  std::string noise;
  double level = 0;
  int n_seeds = 0;
  int n_truth = 0;
  int n_estimated = 0;
  std::map<std::string, SampleSummary> errors;  ///< by name; the `compared` errors that a record has
  LimitSummary limit;
  /// Mean EPE before the refinement, which is the actual noise, if the true flow is known
  std::optional<double> epe_initial_px;

  /// Returns true if the records of level `key`, in a sweep of the parameter `swept`, contribute to this row.
  bool covers(const std::string& swept, const NoiseLevelKey& key) const {
    return CurveKey::covers(swept, key) && key.level == level && key.noise == noise;
  }
};

/// Returns a row for each level that has records with truth, in order of data set, sequence, body (camera
/// first), estimator, level and noise. The rows do not depend on `jobs`.
std::vector<NoiseLevelRow> noise_levels(const NoiseSweep& sweep, int jobs = 1,
                                        const BootstrapOptions& options = {});

Table noise_level_table(const std::vector<NoiseLevelRow>& rows);

}  // namespace sextant
