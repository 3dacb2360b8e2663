#pragma once

// Compares estimators pair by pair, from records only: one row per data set, sequence, body, level and pair
// of estimators, over the frame pairs and seeds that both have estimated.
//
//   difference   mean of second - first, negative if the second is better; 95 % interval by cluster bootstrap
//   p            Wilcoxon's signed-rank test on the means of the clusters (seeds; with one seed: frames)
//   p_corrected  Holm's correction over all rows and both errors of the table
//   detectable   smallest difference that this number of clusters detects at 5 % with probability 80 %
//   verdict      "identical" if no pair differs by more than 1e-9; the estimator with the lower error, if
//                p_corrected <= 0.05 and the interval excludes 0; "too few clusters" with fewer than 2, or if
//                the interval excludes 0, but so few clusters cannot give p_corrected <= 0.05; otherwise "no
//                difference seen"

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

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

}  // namespace sextant
