#pragma once

// Several runs of several systems on one task.
//
//   pooled      statistics of the errors of all runs of a system together: never a mean of RMSEs
//   intervals   of the pooled RMSE and mean, 95 %, bootstrap over runs (lib/stats/bootstrap.h): a run is what
//               was drawn independently, its errors are not. Needs 5 runs
//   comparison  of two systems over the steps both have, each system's errors averaged over its runs there.
//               Neighbouring errors depend on each other, so the differences are averaged over up to 20
//               stretches as long as each other, and the sign-flip test (lib/stats/tests.h) judges their mean

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/metrics/trajectory_errors.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

/// What an error belongs to: body (0: the camera) and row of the reference, or frame.
using ErrorStep = std::pair<int, int>;

/// The errors of one run.
struct RunErrors {
  std::string system;
  std::string run;               ///< what figures call it
  std::vector<double> errors;    ///< may be empty
  std::vector<ErrorStep> steps;  ///< one per error
};

struct SystemSummary {
  std::string name;
  int n_runs = 0;  ///< that have errors
  size_t n_errors = 0;
  ErrorStatistics pooled;
  std::optional<Interval> rmse_interval, mean_interval;
};

/// Error of a minus error of b; clusters are the stretches, p_corrected is over all pairs of systems.
struct SystemComparison : PairedComparison {
  std::string a, b;
  size_t n_common = 0;  ///< steps that both have
};

/// In order of first appearance; systems without errors are left out.
std::vector<SystemSummary> summarize_systems(const std::vector<RunErrors>& runs);
/// Every pair of systems that have enough steps in common (6).
std::vector<SystemComparison> compare_systems(const std::vector<RunErrors>& runs);

}  // namespace sextant
