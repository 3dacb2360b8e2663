#pragma once

// Figures of the distribution of errors.

#include <string>
#include <vector>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

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
