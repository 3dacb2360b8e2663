#pragma once

// From the published code's procedure to ours, one decision at a time: what each does to E_t. Evidence: the
// parts of role `attribution`. Their estimators are called "PATH > DECISION"; in the order of parts and
// plans, each has made one decision more than the one before. The first of a path is the published code, the
// last is ours.
//
// Means are over the pairs and seeds that every step of a path has estimated, so that changes add up to the
// whole. Intervals: 95 %, bootstrap over seeds, paired.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

struct AttributionStep {
  std::string decision;
  std::string part;           ///< where its records are
  IntervalEstimate Et_m;      ///< mean after it
  IntervalEstimate change_m;  ///< of that mean by it; 0 for the first
};

/// One body of one of the paper's sets on one kind of data.
struct AttributionPath {
  std::string set, data, body;
  std::string
      path;  ///< the estimator that stands for the published code's function with which the path begins
  std::vector<AttributionStep> steps;
  IntervalEstimate whole_m;  ///< change from the first step to the last
  size_t n_pairs = 0, n_seeds = 0;
  std::optional<double> published_m;  ///< E_t that the paper prints for the path's function
};

/// By set, data, body, path; without paths of fewer than two steps.
std::vector<AttributionPath> attribution_paths(const Evidence& evidence);

}  // namespace sextant
