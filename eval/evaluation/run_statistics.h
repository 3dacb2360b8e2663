#pragma once

// Statistics of several runs of several systems on the same data.
//
//   pooled      statistics of the errors of all runs of a system together, never a mean of RMSEs
//   intervals   95 % intervals of the pooled RMSE and mean, by the bootstrap over runs
//               (lib/stats/bootstrap.h): runs are independent, the errors within a run are not. At least 5
//               runs are needed
//   comparison  difference of two systems at the steps that both have, with the errors of each system
//               averaged over its runs. Neighbouring errors depend on each other, so the differences are
//               averaged over up to 20 stretches of equal length, and the sign-flip test (lib/stats/tests.h)
//               is applied to these means

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/figure.h"
#include "sextant/metrics/trajectory_errors.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

/// Key of an error: body (0 is the camera) and row or frame of the reference.
using ErrorStep = std::pair<int, int>;

/// The errors of one run.
struct RunErrors {
  std::string system;
  std::string run;               ///< label in figures
  std::vector<double> errors;    ///< may be empty
  std::vector<ErrorStep> steps;  ///< one per error
};

/// Pooled statistics of one system.
struct SystemSummary {
  std::string name;
  int n_runs = 0;  ///< number of runs that have errors
  size_t n_errors = 0;
  ErrorStatistics pooled;
  std::optional<Interval> rmse_interval, mean_interval;
};

/// Error of a minus error of b. The clusters are the stretches; p_corrected accounts for all pairs of
/// systems.
struct SystemComparison : PairedComparison {
  std::string a, b;
  size_t n_common = 0;  ///< number of steps that both have
};

/// Summarises the systems in order of first appearance; systems without errors are left out.
std::vector<SystemSummary> summarize_systems(const std::vector<RunErrors>& runs);
/// Compares every pair of systems that have at least 6 steps in common.
std::vector<SystemComparison> compare_systems(const std::vector<RunErrors>& runs);

// ---- Figures of the distribution of errors.

/// Sample of errors that a figure draws as one line or one box.
struct Distribution {
  std::string title;
  std::vector<double> values;  ///< not empty
};

/// Groups the errors of runs by system, pooled over its runs, in order of first appearance. Runs without
/// errors are left out.
std::vector<Distribution> by_system(const std::vector<RunErrors>& runs);
/// One distribution per run. Runs without errors are left out.
std::vector<Distribution> by_run(const std::vector<RunErrors>& runs);

/// Cumulative distribution: share of errors below x, at 101 quantiles of each sample. `name` is the name of
/// the figure and `axis` the error with its unit.
Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<Distribution>& samples);
/// Box plot: quartiles as boxes, the median as a line, 5 % and 95 % quantiles as whiskers.
Figure box_figure(const std::string& name, const std::string& axis, const std::vector<Distribution>& samples);

/// Several samples whose boxes stand side by side at one tick of the x axis.
struct BoxGroup {
  std::string title;  ///< label of the tick
  std::vector<Distribution> samples;
};
/// Boxes as in box_figure(), coloured by the title of the sample.
Figure grouped_box_figure(const std::string& name, const std::string& axis,
                          const std::vector<BoxGroup>& groups);

}  // namespace sextant
