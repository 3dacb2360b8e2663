#pragma once

// What `evaluate ego` found as a document (eval/report/document.h): its tables, the warnings, and the
// distribution of errors: cumulative per system (runs pooled), and as boxes per run.

#include <vector>

#include "sextant/eval/external/ego_json.h"
#include "sextant/eval/report/document.h"

namespace sextant {

ReportDocument ego_document(const std::vector<EgoResult>& runs, const EgoReference& reference,
                            const EgoOptions& options);

/// Errors of one line or box of a figure.
struct ErrorSample {
  std::string title;
  std::vector<double> values;  ///< not empty
};

/// Share of errors below x, at 101 quantiles each. `name` is that of the figure, `axis` the error with unit.
Figure cumulative_figure(const std::string& name, const std::string& axis,
                         const std::vector<ErrorSample>& samples);
/// Quartiles as boxes, the median as a line, 5 % and 95 % quantiles as whiskers.
Figure box_figure(const std::string& name, const std::string& axis, const std::vector<ErrorSample>& samples);

}  // namespace sextant
