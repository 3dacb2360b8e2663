#pragma once

// Estimators compared pair by pair, from records alone: one row per dataset, sequence, body, level and two
// estimators, over the frame pairs and seeds that both have estimated.
//
//   difference   mean of second - first: below 0 the second is better; 95 % interval by cluster bootstrap
//   p            Wilcoxon's signed ranks on the means of the clusters (seeds; with one seed: frames)
//   p_corrected  Holm's correction over all rows and both errors of the table
//   detectable   the smallest difference that so many clusters find at 5 % with probability 80 %
//   verdict      which has the lower error, where p_corrected <= 0.05 and the interval leaves out 0;
//                "identical" where no pair differs by more than 1e-9; else "no difference seen"

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

/// p, p_corrected and detectable are none with fewer than 2 clusters.
struct ErrorComparison : PairedComparison {
  double mean_first = 0;
  bool identical = false;
};

struct ComparisonRow {
  std::string parameter, dataset, sequence, body, noise, first, second;
  double level = 0;
  int n_pairs = 0;                                ///< that both have estimated
  int n_only_first = 0;                           ///< estimated by the first alone
  int n_only_second = 0;                          ///< by the second alone
  std::map<std::string, ErrorComparison> errors;  ///< by name; the `compared` ones that both have

  /// Whether the records of that level are behind this row.
  bool covers(const std::string& swept, const NoiseLevelKey& key) const {
    return swept == parameter && key.dataset == dataset && key.sequence == sequence && key.body == body &&
           (key.estimator == first || key.estimator == second) && key.level == level && key.noise == noise;
  }
};

/// Of summaries, whose pairs are known by seed alone: rows only where both have estimated the same pairs.
/// `n_left_out` counts the others.
/// Estimators in the order of the records, every two of them; rows in order of dataset, sequence, body,
/// level.
std::vector<ComparisonRow> compare_estimators(const std::vector<NoiseSweep>& sweeps, int jobs = 1,
                                              const BootstrapOptions& options = {}, size_t* n_left_out = nullptr);

std::string verdict(const ErrorComparison& comparison, const ComparisonRow& row);

Table comparison_table(const std::vector<ComparisonRow>& rows);

}  // namespace sextant
