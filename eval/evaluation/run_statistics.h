#pragma once

// Statistics of several runs of several systems on the same data.
//
//   pooled      statistics of the errors of all runs of a system together, never a mean of RMSEs. The caller
//               leaves out runs that repeat an earlier one
//   intervals   95 % intervals of the pooled RMSE and mean, by the bootstrap over runs
//               (lib/stats/bootstrap.h): runs are independent, the errors within a run are not. At least 5
//               runs are needed
//   comparison  difference of two systems at the steps that both have, with the errors of each system
//               averaged over its runs. Its p-value depends on what is independent:
//     blocks      errors that depend on their neighbours only, such as errors of single motions: the
//                 differences are averaged over the bodies of a frame, because bodies seen by one camera
//                 share its error, then over up to 20 blocks of successive frames, each at least twice as
//                 long as an error overlaps with later ones. The sign-flip test (lib/stats/tests.h) is
//                 applied to the means of the blocks; p is 1 if their mean has another sign than the
//                 difference
//     runs        errors that accumulate, such as the position error of odometry, a random walk: two parts
//                 of one path are never independent, only the runs are. The Mann-Whitney test
//                 (lib/stats/tests.h) is applied to the mean errors of the runs of both systems

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/figure.h"
#include "sextant/metrics/trajectory_errors.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

/// Key of an error: of an object motion its body and frame; of a pose 0 and its row in the reference; of a
/// pair of poses their rows, so that only errors over the same motion are compared.
using ErrorStep = std::pair<int, int>;

/// The errors of one run.
struct RunErrors {
  std::string system;
  std::string run;               ///< label in figures
  std::vector<double> errors;    ///< may be empty
  std::vector<ErrorStep> steps;  ///< one per error
  /// Number of later errors that share a part of the motion of an error, as all pairs 100 m apart do
  size_t n_overlapping = 0;
};

/// Pooled statistics of one system.
struct SystemSummary {
  std::string name;
  int n_runs = 0;  ///< number of runs that have errors
  size_t n_errors = 0;
  ErrorStatistics pooled;
  std::optional<Interval> rmse_interval, mean_interval;
};

/// The units of the data that are independent of each other; see above.
enum class IndependentUnit { blocks, runs };

/// Error of a minus error of b.
struct SystemComparison {
  std::string a, b;
  size_t n_common = 0;                   ///< number of steps that both have
  std::optional<double> difference;      ///< mean over these steps; nullopt if there are none
  int n_blocks = 0;                      ///< 0 if the runs are the independent units
  int n_runs_a = 0, n_runs_b = 0;        ///< number of runs that have some of these steps
  std::optional<double> p, p_corrected;  ///< two-sided; p_corrected accounts for all pairs of systems
  std::string why_no_p;                  ///< reason, as a sentence without a full stop; empty if there is p
};

/// Summarises the systems in order of first appearance; systems without errors are left out.
std::vector<SystemSummary> summarize_systems(const std::vector<RunErrors>& runs);
/// Compares every pair of systems. p is nullopt without common steps, with fewer than 6 of them or 6
/// blocks, with one run of a or b where the runs are the units, and where no outcome could give p < 0.05.
std::vector<SystemComparison> compare_systems(const std::vector<RunErrors>& runs, IndependentUnit unit);
/// Smallest p that the comparison of n_a with n_b runs can give: 2 / binomial(n_a + n_b, n_a), at most 1.
double smallest_p_of_runs(int n_a, int n_b);
/// Sentences that explain for which pairs of systems p is missing, one per reason.
std::vector<std::string> notes_on_missing_p(const std::vector<SystemComparison>& comparisons);

// ---- Figures of the distribution of errors.

/// Sample of errors that a figure draws as one line or one box.
struct Distribution {
  std::string title;
  std::vector<double> values;  ///< not empty
  std::string colour{};        ///< "": line_colour() by its place in the figure
};

/// Returns the colour of a run, given with its number among all runs, in the figures of a page.
using RunColour = std::function<std::string(const RunErrors&, size_t)>;

/// Groups the errors of runs by system, pooled over its runs, in order of first appearance, with the colour
/// of the first run. Runs without errors are left out.
std::vector<Distribution> by_system(const std::vector<RunErrors>& runs, const RunColour& colour);
/// One distribution per run. Runs without errors are left out.
std::vector<Distribution> by_run(const std::vector<RunErrors>& runs, const RunColour& colour);

/// Cumulative distribution: share of errors below x, at 101 quantiles of each sample. `name` is the name of
/// the figure and `axis` the error with its unit.
Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<Distribution>& samples);
/// Box plot: quartiles as boxes, the median as a line, 5 % and 95 % quantiles as whiskers. Boxes are numbered
/// if some have the same colour.
Figure box_figure(const std::string& name, const std::string& axis, const std::vector<Distribution>& samples);

/// Several samples whose boxes stand side by side at one tick of the x axis.
struct BoxGroup {
  std::string title;  ///< label of the tick
  std::vector<Distribution> samples;
};
/// Boxes as in box_figure(); samples with the same title have the same place and colour in every group.
Figure grouped_box_figure(const std::string& name, const std::string& axis,
                          const std::vector<BoxGroup>& groups);

}  // namespace sextant
