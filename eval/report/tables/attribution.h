#pragma once

// Attribution: the change of E_t by each decision on the way from the published code's procedure to ours. The
// evidence is the records of the experiments with role `attribution`. Their estimators are called "PATH >
// DECISION"; in the order of experiments and plans, each estimator of a path makes one more decision as we
// do. A path begins with the published code and ends with our default.
//
// Means are over the pairs and seeds that every step of a path has estimated, so that the changes add up to
// the total. Intervals: 95 %, paired bootstrap over seeds.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct AttributionStep {
  std::string decision;
  std::string part;           ///< where its records are
  IntervalEstimate Et_m;      ///< mean E_t with this decision and those before it
  IntervalEstimate change_m;  ///< change of that mean by the decision; 0 for the first step
};

/// One body of one of the paper's sets on one kind of data.
struct AttributionPath {
  std::string set, data, body;
  /// Estimator that stands for the function of the published code with which the path begins
  std::string path;
  std::vector<AttributionStep> steps;
  IntervalEstimate whole_m;  ///< change from the first step to the last
  size_t n_pairs = 0, n_seeds = 0;
  std::optional<double> published_m;  ///< E_t that the paper prints for this function
};

/// Returns the paths in order of set, data, body and path; paths with fewer than two steps are left out.
std::vector<AttributionPath> attribution_paths(const Evidence& evidence);

}  // namespace sextant
