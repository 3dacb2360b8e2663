#pragma once

// Checks the motions of a third-party estimator against the truth of its case: centimetres, inverse motions, another
// frame than the declared one (eval/diagnosis). The estimator never sees the truth or these texts.

#include <string>
#include <vector>

#include "sextant/eval/experiment/case_runner.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// One line for each diagnosis; `estimator` begins it.
std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator);

}  // namespace sextant
