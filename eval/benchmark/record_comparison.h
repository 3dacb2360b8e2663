#pragma once

// Comparison of the records that a folder stores with records that the verifying program computes
// (benchmark_verification.h). Every function returns the first difference, or an empty text.

#include <string>
#include <vector>

#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/records/record.h"

namespace sextant {

/// Compares the stored records of a case with those of a run. Only bodies that the track counts must be
/// stored. `metric` is that of the suite.
std::string difference(const std::vector<Record>& stored, const std::vector<Record>& again,
                       const SuiteTrack& track, const std::string& metric);

/// Compares the bounds of the stored records of a case with those of the same points without an estimate
/// (benchmark_verification.cc). Every stored bound must be one of these; records with status ok that the
/// track counts must have those of E_t, E_R and `metric`.
std::string difference_of_bounds(const std::vector<Record>& stored, const std::vector<Record>& again,
                                 const SuiteTrack& track, const std::string& metric);

/// Compares the values of a stored record that depend on the ground truth only (truth_only, definitions.h)
/// with those of a record of the same frame and body. Values that are not stored are not compared.
std::string difference_of_truth(const Record& stored, const Record::Numbers& truth);

}  // namespace sextant
