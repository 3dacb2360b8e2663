#pragma once

// What `evaluate objects` found in the logs of several runs: pooled scores with intervals, comparisons of
// systems, and, as a document (eval/report/document.h), these tables with the distributions of the errors in
// each frame that a preset uses. A run is told by the seed of its records: its place on the command line.

#include <string>
#include <vector>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/document.h"
#include "sextant/metrics/presets.h"

namespace sextant {

/// The errors with that key of all records that have it, a run each; systems are the records' estimators.
std::vector<RunErrors> object_run_errors(const std::vector<Record>& records, const std::string& key);

/// A row per preset and system: E_t and E_R over all objects and runs with 95 % intervals over runs.
Table object_system_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);
/// A row per error and pair of systems; none for a single system.
Table object_comparison_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

/// {"schema":1,"presets":[{"preset","aggregate","rows":[..]}],"systems":[..],"comparisons":[..],
///  "warnings":[..]}; rows as in the tables.
Json object_json(const std::vector<Record>& records, std::span<const MetricPreset> presets,
                 const std::vector<std::string>& warnings);

ReportDocument object_document(const std::vector<Record>& records, std::span<const MetricPreset> presets,
                               const std::vector<std::string>& folders,
                               const std::vector<std::string>& warnings);

}  // namespace sextant
