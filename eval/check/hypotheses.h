#pragma once

// Mistakes that people make with data sets' conventions: a table of named hypotheses. Each says what the
// report tells the user and how it undoes the mistake in sampled data; the diagnosis (diagnosis.h) keeps the
// one under which the checks pass. How to add one: a line in the table of hypotheses.cc.

#include <functional>
#include <string>
#include <vector>

#include "sextant/eval/check/convention_data.h"

namespace sextant {

struct Hypothesis {
  /// "flow is backward: ..."; "{}" in it becomes the number that undo() found.
  std::string cause;
  /// Undoes the mistake. False: does not apply to these data. A fitted number goes to `fitted`.
  std::function<bool(ConventionData& data, double& fitted)> undo;
  double price = 0;          ///< of two that explain the data alike, the cheaper is told
  bool fits_number = false;  ///< undo() searches: slow, and can explain much
};

/// Those that make sense for these data.
std::vector<Hypothesis> hypotheses(const ConventionData& data);

}  // namespace sextant
