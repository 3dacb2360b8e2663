#pragma once

// `sextant trend`: past results as series over time, and where their level changed (stats/tests.h).
//
//   per dataset, sequence, estimator and level   mean of each compared error (metrics/definitions.h) of the camera
//                                                and of the objects together, share of their cases that was
//                                                estimated
//   per dataset, sequence, estimator and stage   median ratio of its times to those of the first result, case by
//                                                case, times their median
//   per benchmark                                median time
//
// A smallest step counts as in a comparison: minimum_effect of the policy times the series' median.
// Times of fewer than 6 points do not show their own noise: they are drawn, and no change is marked.
// Those of runs are wall-clock and not repeated: of them unrepeated_effect counts.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/report/document.h"

namespace sextant {

struct Series {
  std::string name;    ///< "synthetic s18 joint_flow level 0.1 objects"
  std::string metric;  ///< "Et_m", "coverage", "time" (of a run), "benchmark"
  std::string unit;
  std::vector<std::optional<double>> values;  ///< one per point; none where a point does not have it
  std::vector<size_t> changes;                ///< indices of points at which a new level begins
};

struct History {
  std::vector<std::string> labels;  ///< of the points, oldest first: folder, and commit where known
  std::vector<Series> series;       ///< in order of name and metric
};

/// Each path is one point where it holds results itself, else every folder in it is one, in order of their names
/// ("run-9" before "run-10"). Throws Error on paths without results and on bad results.
History read_history(const std::vector<std::filesystem::path>& paths, const Policy& policy);

/// Tables and figures of it; draw and write with html/html.h.
ReportDocument history_document(const History& history);
/// {"points","series":[{"name","metric","unit","values","changes"}]}
Json history_json(const History& history);

}  // namespace sextant
