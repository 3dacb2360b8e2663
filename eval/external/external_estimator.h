#pragma once

// Estimators "external:CONFIG.json": an external program, run once per case on files with the noise of the
// case. Its results become records like those of built-in estimators, with the same truth, metrics and bound
// (docs/external-estimators.md). The status follows from the results only, however the program ended:
//
//   a pose, or motion, exists      ok, or no_truth
//   it does not exist              lost; not_detected for an object that the results never name
//   the results cannot be read     diverged
//
// Exit code, time-out and every problem are reported (PairSolver::problems()) and written to the case's
// log.txt.

#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/external/external_config.h"

namespace sextant {

/// Opens an estimator. Throws Error on an invalid configuration.
std::shared_ptr<const CaseEstimator> open_external_estimator(const std::string& config,
                                                             const Json& overrides);

/// Adds the kind "external:CONFIG.json" to make_case_estimator(); further calls do nothing.
void add_external_estimators();

}  // namespace sextant
