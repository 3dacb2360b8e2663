#pragma once

// Paired comparison of an estimator with a reference, track by track: the change of the mean error of the suite's
// metric over the frame pairs that both estimated (stats/paired_comparison.h: a ratio of means over sequences and bodies as
// strata, seeds and frames as crossed clusters), with p-values corrected by Holm over all rows.

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
  int n_pairs = 0;         ///< frame pairs that both estimated
  double change_percent = 0;  ///< error of the estimator over that of the reference, minus 1
  std::optional<Interval> interval_percent;
  std::optional<double> p, p_corrected;
};

/// Compares two folders of sweeps (card.h), each with one result. Throws Error if they have no case in common.
std::vector<CardComparison> compare_benchmarks(const Suite& suite, const std::filesystem::path& folder,
                                               const std::filesystem::path& reference);

Table comparison_table(const std::vector<CardComparison>& rows);

}  // namespace sextant
