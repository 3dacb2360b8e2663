#pragma once

// Scores logged object motions under every metric preset. With H the motion from frame k-1 to k in the world,
// L the true T_world_object at k-1 and T the camera's T_world_camera (docs/metrics.md):
//
//   Et_world   E of H                       Et_body   E of inverse(L) H L
//   Et (camera) E of inverse(T_k) H T_k-1, the estimate with its own cameras
//   v = |trans(inverse(L) H L)| / dt: the displacement of the object's true origin (logs hold no points)
//
// A log in the body frame determines the other errors only if L is known; errors that a preset needs but the
// log does not determine stay empty. Coverage is the share of steps with truth that have an estimate. Truth
// for steps that the log lacks comes from the true motions or poses of the log or of a source. Without a
// source, steps that the log lacks between the first and the last frame of an object count as steps without
// an estimate.

#include <string>
#include <vector>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

/// Returns one record per object and frame with a motion or truth. Its status is ok, no_truth or, for truth
/// without an estimate, lost (the object is in the log at other frames) or not_detected. `run` becomes the
/// seed of the records.
std::vector<Record> object_records(const ObjectLog& log, const std::string& dataset,
                                   const std::string& sequence, double rate_hz, uint64_t run = 0);

/// Table with one row per object and one over all objects, all runs together; cells stay empty if a preset
/// has no errors.
Table object_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

// ---- Results over the logs of several runs: pooled scores with intervals, comparisons of systems and, in
// the document, the distributions of the errors that a preset uses. The seed of a record is the run: its
// place on the command line.

/// Returns the errors called `key` of all records that have it, grouped by run; the systems are the
/// estimators of the records.
std::vector<RunErrors> object_run_errors(const std::vector<Record>& records, const std::string& key);

/// Table with one row per preset and system: E_t and E_R over all objects and runs, with 95 % intervals over
/// runs.
Table object_system_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);
/// Table with one row per error and pair of systems; without rows for a single system.
Table object_comparison_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

}  // namespace sextant
