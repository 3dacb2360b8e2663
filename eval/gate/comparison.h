#pragma once

// `sextant compare`: two sides under a policy, and what came out as tables. docs/ci.md says it in words.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/gate/accuracy.h"
#include "sextant/eval/gate/speed.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct Comparison {
  std::string base;  ///< path
  std::string fresh;
  std::vector<Mismatch> findings;
  std::vector<AccuracyRow> accuracy;
  std::vector<StatusRow> statuses;
  std::vector<SpeedRow> speed;
  int n_cases = 0;  ///< records paired
  int n_runs = 1;   ///< repetitions of runs on the side that has fewer
  GateVerdict verdict = GateVerdict::invalid;
};

/// Bad input does not throw: it is a finding "input", and the verdict `invalid`.
Comparison compare_paths(const std::filesystem::path& base, const std::filesystem::path& fresh,
                         const Policy& policy, int jobs);

/// One line: "regressed: 2 of 54 errors worse, ...".
std::string headline(const Comparison& comparison);

/// Rows in order of weight: worst verdict first. `changed_only` leaves out rows that are ok.
Table findings_table(const Comparison& comparison);
Table accuracy_table(const Comparison& comparison, bool changed_only);
Table status_table(const Comparison& comparison);
Table speed_table(const Comparison& comparison, bool changed_only);

}  // namespace sextant
