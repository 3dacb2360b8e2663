#pragma once

// Pairs the records of both sides and compares what an estimator should not change. Findings:
//
//   cases, new_cases   records, or errors of records estimated on both sides, that only one side has
//   data               values that depend on the truth only and differ
//   measurements       a note: errors of the measured flow (`epe_measured_*`) that differ, although data and
//                      configuration are the same
//   covariances        a note: an estimator whose mean NEES, over the records of the camera or of all objects
//                      that have one on both sides, changed by more than the minimum_effect of `nees`

#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"
#include "sextant/eval/gate/subject_cases.h"

namespace sextant {

/// Returns the subjects that both sides have, and appends to `findings`, which already holds those of
/// compare_provenance().
std::vector<PairedCases> pair_records(const Subjects& base, const Subjects& fresh, const Policy& policy,
                                      std::vector<Mismatch>& findings);

}  // namespace sextant
