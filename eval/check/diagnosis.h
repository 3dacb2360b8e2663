#pragma once

// Runs the convention checks and looks for the cause of what they find: every hypothesis of the table is
// undone in a copy of the data and the checks run again. A check that did not pass is put down to the
// hypothesis under which it passes, nothing else breaks, and all checks together are nearest to perfect; to
// several when they do equally well; else to "no known cause fits".
//
// A sharp check that passes is looked at as well: when undoing a mistake takes nearly all of its residual
// away, exact data have that mistake, however small the residual was.

#include <functional>
#include <string>
#include <vector>

#include "sextant/eval/check/convention_data.h"
#include "sextant/eval/check/conventions.h"

namespace sextant {

struct Diagnosis {
  Finding finding;
  CheckOutcome outcome = CheckOutcome::pass;
  std::string cause;  ///< of a check that did not pass; else empty
};

std::vector<Diagnosis> diagnose(const ConventionData& data, int jobs);

// ---- mistakes that people make with data sets' conventions: a table of named hypotheses. Each says what the
// report tells the user and how it undoes the mistake in sampled data; the diagnosis (diagnosis.h) keeps the
// one under which the checks pass. How to add one: a line in the table of hypotheses.cc.

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
