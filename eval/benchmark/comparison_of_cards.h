#pragma once

// Paired comparison of an estimator with a reference, track by track: the change of the mean error of the
// suite's metric over the frame pairs that both estimated. It is a ratio of means over sequences and bodies
// as strata, with seeds and frames as crossed clusters (stats/paired_comparison.h); p-values are corrected by
// Holm over all rows.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct CardComparison {
  std::string track, body;
  double level = 0;
  int n_pairs = 0;            ///< frame pairs that both estimated
  double change_percent = 0;  ///< 100 (error of the estimator / error of the reference - 1)
  std::optional<Interval> interval_percent;
  std::optional<double> p, p_corrected;
};

/// Compares two folders of sweeps (card.h), each with one result. Throws Error if they have no case in
/// common.
std::vector<CardComparison> compare_benchmarks(const Suite& suite, const std::filesystem::path& folder,
                                               const std::filesystem::path& reference);

Table comparison_table(const std::vector<CardComparison>& rows);

}  // namespace sextant
