#pragma once

// `sextant trend`: past results as series over time, with the points at which their level changed
// (stats/tests.h).
//
//   per dataset, sequence, estimator and level   mean of each compared error (metrics/definitions.h) of the
//                                                camera, and of all objects; share of their cases with truth
//                                                that have status ok (coverage)
//   per dataset, sequence, estimator and stage   median ratio of its times to those of the first result, case
//                                                by case, multiplied by the median time of the first result
//   per benchmark                                median CPU time
//
// The smallest step that counts is minimum_effect of the policy times the median of the series. The times of
// runs are wall-clock times without repetitions: for these the factor is unrepeated_effect. Fewer than 6
// results do not show their own noise: they are drawn, and no change is marked.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/report/document.h"

namespace sextant {

/// One quantity over all points.
struct Series {
  std::string name;    ///< "synthetic s18 joint_flow level 0.1 objects"
  std::string metric;  ///< "Et_m", "coverage", "time" (of a run) or "benchmark"
  std::string unit;
  std::vector<std::optional<double>>
      values;                   ///< one per point; empty if the point does not have the quantity
  std::vector<size_t> changes;  ///< indices of points at which a new level begins
};

/// Series over all points.
struct History {
  std::vector<std::string> labels;      ///< one per point, oldest first: folder, and commit if known
  std::vector<Series> series;           ///< in order of name and metric
  std::vector<std::string> warnings{};  ///< results whose configuration or data differ from the one before
};

/// Reads past results. A file, or a folder that contains results, is one point; in any other folder, every
/// folder and every *.json file is one point, in natural order of names ("run-9" before "run-10"). Throws
/// Error on paths without results, on bad results, and if there are fewer than two points.
History read_history(const std::vector<std::filesystem::path>& paths, const Policy& policy);

/// Makes the page with tables and figures of all series; html/html.h draws and writes it.
ReportDocument history_document(const History& history);
/// Formats {"points","series":[{"name","metric","unit","values","changes"}]}.
Json history_json(const History& history);

}  // namespace sextant
