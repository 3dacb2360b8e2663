#pragma once

// The definitions of a record's errors, as they are written into the provenance of every run: numbers whose
// definitions differ must not be compared. docs/metrics.md explains them.
//
// Whoever changes what is computed under a name raises its version here, in the same commit.

#include <span>
#include <string>

#include "sextant/base/options.h"

namespace sextant {

struct MetricDefinition {
  std::string name;  ///< key of a record's "errors"
  int version = 1;
  std::string unit;
  std::string definition;
  /// Of the measurements rather than of the estimate: no estimator can make it better.
  bool of_input = false;
};

/// All of them, lower is better.
std::span<const MetricDefinition> metric_definitions();

/// {"Et_m": "1: length of ... [m]", ..}
Json metric_definitions_json();

/// {"paper": "Et_m, ER_deg, Ev_kmh against v_gt_kmh, mean", ..}
Json metric_presets_json();

}  // namespace sextant
