#pragma once

// Several runs of several systems against one reference.
//
//   pooled      statistics of the errors of all runs of a system together: never a mean of RMSEs
//   intervals   of the pooled RMSE and mean, 95 %, bootstrap over runs (lib/stats/bootstrap.h): a run is what
//   was
//               drawn independently, its errors are not. Needs 2 runs
//   comparison  of two systems over the reference poses both have, each system's errors averaged over its
//   runs
//               there. Neighbouring errors depend on each other, so the differences are averaged over up to
//               20 stretches as long as each other, and the sign-flip test (lib/stats/tests.h) judges their
//               mean

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/external/ego_evaluation.h"

namespace sextant {

struct SystemSummary {
  std::string name;
  int n_runs = 0;
  size_t n_errors = 0;
  ErrorStatistics pooled;
  std::optional<Interval> rmse_interval, mean_interval;
};

struct SystemComparison {
  std::string a, b;
  size_t n_common = 0;  ///< reference poses that both have
  int n_stretches = 0;
  double mean_difference = 0;  ///< error of a minus error of b
  double p = 1;                ///< two-sided; Holm-adjusted over the comparisons
};

/// In order of first appearance.
std::vector<SystemSummary> summarize_systems(const std::vector<EgoResult>& runs);
/// Every pair of systems that have enough poses in common (6).
std::vector<SystemComparison> compare_systems(const std::vector<EgoResult>& runs);

}  // namespace sextant
