#pragma once

// Estimators "external:CONFIG.json": a program of somebody else, run once per case on files with the noise of
// the case on them. Its results become records as those of estimators inside, with the same truth, metrics
// and bound (docs/external-estimators.md):
//
//   a pose, or motion, is there    ok, or no_truth
//   it is not                      lost; of an object that the results never name: not_detected
//   the results cannot be read     diverged
//
// whatever became of the program; its exit code, time-out and every problem are told (PairSolver::problems())
// and stand in the case's log.txt.

#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/external/external_config.h"

namespace sextant {

/// Throws Error on a bad configuration.
std::shared_ptr<const CaseEstimator> open_external_estimator(const std::string& config,
                                                             const Json& overrides);

/// Makes make_case_estimator() know "external:CONFIG.json"; once is enough.
void add_external_estimators();

}  // namespace sextant
