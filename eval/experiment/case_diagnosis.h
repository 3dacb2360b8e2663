#pragma once

// Checks the motions of a third-party estimator against the truth of its case: centimetres, inverse motions, another
// frame than the declared one (eval/diagnosis). The estimator never sees the truth or these texts.

#include <string>
#include <vector>

#include "sextant/eval/experiment/case_runner.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// One line for each diagnosis; `estimator` begins it. `recorded_camera`: the poses that the motions of the camera are from,
/// where there are such; quaternions in another order show in them alone.
std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator, const Trajectory* recorded_camera = nullptr);

}  // namespace sextant
