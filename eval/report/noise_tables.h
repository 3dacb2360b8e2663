#pragma once

// Tables of noise sweeps: errors by level, estimators compared, and requested and achieved noise.
//
// Errors by noise level, from records only: one row per data set, sequence, body, estimator and level.
//
//   mean, rmse, quantiles  over the estimated pairs of all seeds, with 95 % intervals by the cluster
//                          bootstrap (stats/bootstrap.h); a cluster is the pairs of a seed, or a frame if
//                          there is one seed
//   coverage               estimated pairs / pairs with truth, so that a lost body lowers it
//
// Records of bodies without truth, or static by truth, are not counted.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"
#include "sextant/stats/clustered_sample.h"
#include "sextant/stats/paired_comparison.h"

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

// ---- Comparison of estimators, pair by pair: one row per data set, sequence, body, level and pair of
// estimators, over the frame pairs and seeds that both have estimated.
//
//   difference   mean of second - first, negative if the second is better; 95 % interval by cluster bootstrap
//   p            Wilcoxon's signed-rank test on the means of the clusters (seeds; with one seed: frames)
//   p_corrected  Holm's correction over all rows and both errors of the table
//   detectable   smallest difference that this number of clusters detects at 5 % with probability 80 %
//   verdict      "identical" if no pair differs by more than 1e-9; the estimator with the lower error, if
//                p_corrected <= 0.05 and the interval excludes 0; "too few clusters" with fewer than 2, or if
//                the interval excludes 0, but so few clusters cannot give p_corrected <= 0.05; otherwise "no
//                difference seen"

/// p, p_corrected and detectable are empty with fewer than 2 clusters.
struct ErrorComparison : PairedComparison {
  double mean_first = 0;
  bool identical = false;
  double smallest_p = 0;  ///< smallest p_corrected that its number of clusters allows
};

struct ComparisonRow {
  std::string parameter, dataset, sequence, body, noise, first, second;
  double level = 0;
  int n_pairs = 0;                                ///< pairs that both have estimated
  int n_only_first = 0;                           ///< pairs that only the first has estimated
  int n_only_second = 0;                          ///< pairs that only the second has estimated
  std::map<std::string, ErrorComparison> errors;  ///< by name; the `compared` errors that both have

  /// Returns true if the records of level `key`, in a sweep of the parameter `swept`, contribute to this row.
  bool covers(const std::string& swept, const NoiseLevelKey& key) const {
    return swept == parameter && key.dataset == dataset && key.sequence == sequence && key.body == body &&
           (key.estimator == first || key.estimator == second) && key.level == level && key.noise == noise;
  }
};

/// Compares every two estimators of a level; the first is the one that the records mention first. Rows are in
/// order of sweep, data set, sequence, body and level. Summaries (records/case_summary.h) identify pairs by
/// seed only, so they are compared only if both estimators have estimated the same pairs; `n_left_out` counts
/// the comparisons for which this is not so.
std::vector<ComparisonRow> compare_estimators(const std::vector<NoiseSweep>& sweeps, int jobs = 1,
                                              const BootstrapOptions& options = {},
                                              size_t* n_left_out = nullptr);

std::string verdict(const ErrorComparison& comparison, const ComparisonRow& row);

Table comparison_table(const std::vector<ComparisonRow>& rows);

// ---- Requested and achieved noise, from the run.json of runs and sweeps: one row per source, level and
// channel. The statistics are over the draws that every estimator used.
//
//   depth      delta_d [px]: standard deviation of the depth error times f b / z^2
//   flow x, y  standard deviation [px], per body;   flow EPE: mean length of the error vector [px], per body
//   neighbours correlation between horizontally neighbouring pixels

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
