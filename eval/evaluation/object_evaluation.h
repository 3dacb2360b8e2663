#pragma once

// Scores of logged object motions under every metric preset, from the same errors. With H the motion from
// frame k-1 to k in the world, L the true T_world_object at k-1 and T the camera's T_world_camera
// (docs/metrics.md):
//
//   Et_world   E of H                       Et_body   E of inverse(L) H L
//   Et (camera) E of inverse(T_k) H T_k-1, the estimate with its own cameras
//   v = |trans(inverse(L) H L)| / dt: the displacement of the object's true origin (logs hold no points)
//
// A log in the body frame gives the others only where L is known, and a preset without its errors is left
// empty. Coverage: steps with truth that have an estimate. Truth of steps that the log does not have comes
// from the true motions or poses of the log or of a source. Without a source, steps that a log lacks between the first
// and the last frame of an object count as steps without an estimate.

#include <string>
#include <vector>

#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

/// One per object and frame with a motion or truth; status ok, no_truth, or, with truth alone, lost (the
/// object is in the log elsewhere) or not_detected. `run` becomes their seed.
std::vector<Record> object_records(const ObjectLog& log, const std::string& dataset,
                                   const std::string& sequence, double rate_hz, uint64_t run = 0);

/// One row per object, and one over all, all runs together; empty numbers where the preset has no errors.
Table object_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

// ---- what `evaluate objects` found in the logs of several runs: pooled scores with intervals, comparisons of
// systems, and, as a document (eval/report/document.h), these tables with the distributions of the errors in
// each frame that a preset uses. A run is told by the seed of its records: its place on the command line.

/// The errors with that key of all records that have it, a run each; systems are the records' estimators.
std::vector<RunErrors> object_run_errors(const std::vector<Record>& records, const std::string& key);

/// A row per preset and system: E_t and E_R over all objects and runs with 95 % intervals over runs.
Table object_system_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);
/// A row per error and pair of systems; none for a single system.
Table object_comparison_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

}  // namespace sextant
