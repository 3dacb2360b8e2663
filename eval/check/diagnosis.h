#pragma once

// Runs the convention checks and looks for the cause of what they find: every hypothesis of the table is
// undone in a copy of the data and the checks run again. A check that did not pass is put down to the
// hypothesis under which it passes, nothing else breaks, and all checks together are nearest to perfect; to
// several when they do equally well; else to "no known cause fits".
//
// A sharp check that passes is looked at as well: when undoing a mistake takes nearly all of its residual
// away, exact data have that mistake, however small the residual was.

#include <string>
#include <vector>

#include "sextant/eval/check/convention_data.h"
#include "sextant/eval/check/conventions.h"
#include "sextant/eval/diagnosis/hypothesis.h"

namespace sextant {

struct Diagnosis {
  Finding finding;
  CheckOutcome outcome = CheckOutcome::pass;
  std::string cause;  ///< of a check that did not pass; else empty
};

std::vector<Diagnosis> diagnose(const ConventionData& data, int jobs);

/// The mistakes that people make with data sets' conventions and that make sense for these data: what the report tells the
/// user, and how the mistake is undone in sampled data. How to add one: a line in the table of hypotheses.cc.
std::vector<Hypothesis<ConventionData>> hypotheses(const ConventionData& data);

}  // namespace sextant
