#pragma once

// Figures of how errors are distributed.

#include <string>
#include <vector>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Errors of one line or box of a figure.
struct Distribution {
  std::string title;
  std::vector<double> values;  ///< not empty
};

/// Runs with errors: those of a system pooled, in order of first appearance; and each for itself.
std::vector<Distribution> by_system(const std::vector<RunErrors>& runs);
std::vector<Distribution> by_run(const std::vector<RunErrors>& runs);

/// Share of errors below x, at 101 quantiles each. `name` is that of the figure, `axis` the error with unit.
Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<Distribution>& samples);
/// Quartiles as boxes, the median as a line, 5 % and 95 % quantiles as whiskers.
Figure box_figure(const std::string& name, const std::string& axis, const std::vector<Distribution>& samples);


/// Boxes of several samples beside each other at each place of the axis below.
struct BoxGroup {
  std::string title;  ///< below the boxes
  std::vector<Distribution> samples;
};
/// Boxes as in box_figure(), coloured by the title of the sample.
Figure grouped_box_figure(const std::string& name, const std::string& axis, const std::vector<BoxGroup>& groups);

}  // namespace sextant
