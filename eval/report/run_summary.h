#pragma once

// Summary of a run, from records only: one row per data set, sequence, estimator and body under a metric
// preset, and the counts of the dynamic/static classification.
//
//   truth      pairs with truth in both frames: all pairs for the camera; for objects those whose truth is
//              not static (pairs with dynamic_gt = 0 are left out, pairs without it are kept)
//   estimated  pairs of these with status ok;   coverage = estimated / truth
//
// The metrics that the list (metrics/definitions.h) marks `in_summary` are computed over `estimated`. Every
// record that is not ok is counted in `other`.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"
#include "sextant/metrics/definitions.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {

/// One row of the summary. Its records may have several noise levels, but it has no swept parameter.
struct BodySummary : CurveKey {
  int n_pairs = 0;  ///< number of records of this body
  int n_truth = 0;
  int n_estimated = 0;
  std::optional<double> coverage;  ///< 0..1
  /// Metrics by name: those marked `in_summary` (metrics/definitions.h) that a record has. The preset may
  /// take "Et_m" of an object from Et_body_m.
  std::map<std::string, double> metrics;
  std::string other;  ///< "gated(distance) 3, lost 1"
};

/// Returns rows in order of data set, sequence and estimator; the camera first, then objects by id.
std::vector<BodySummary> summarize(const std::vector<Record>& records, const MetricPreset& preset);

/// Computes one metric over estimated records of one kind of body: the preset's aggregate for its errors, the
/// mean for all others; empty if no record has it.
std::optional<double> summary_number(const RecordRefs& estimated, const MetricDefinition& metric,
                                     const MetricPreset& preset);

/// Formats the records that are not ok by status, e.g. "gated(distance) 3, lost 1".
std::string other_statuses(const RecordRefs& records);

/// Counts the decisions of the object records that have both the estimated and the true class, except objects
/// that a gate on distance or area left out.
ClassificationCounts count_classification(const std::vector<Record>& records);

Table summary_table(const std::vector<Record>& records, const MetricPreset& preset);

/// summary_table() for a terminal of 100 columns: per data set, sequence and estimator the most important
/// columns (body, estimated, coverage, E_t, E_R, E_v, reasons for missing estimates) of bodies with coverage.
/// With `all` every column, however wide.
std::string summary_text(const std::vector<Record>& records, const MetricPreset& preset, bool all);

/// Returns {"schema","preset","aggregate","rows":[...],"classification":{...}}.
Json summary_json(const std::vector<Record>& records, const MetricPreset& preset);

// ---- Consistency of the bodies' estimates (`sextant run --consistency`).

/// Returns a table of the means of values.split_nees, of its two kinds, of values.nees and of
/// values.expansion_chi2 by body, with advice if they are far too large; empty if no record has split_nees.
std::string consistency_text(const std::vector<Record>& records);

// ---- Components of a camera's step errors that are equal in every pair, or grow along the sequence. They
// are not caused by measurement noise but by calibration, scale, or the heading of the truth.
//
//   e_k = estimated minus true translation of pair k (T_prev_curr, axes of the previous camera, m)
//   mean, scatter: mean and standard deviation (n - 1) of e by axis
//   drift: slope of the least-squares line through e_x (to the right) over the frame number: the change of
//   the error of a step from one frame to the next, m

struct StepErrors {
  Eigen::Vector3d mean_m{0, 0, 0}, scatter_m{0, 0, 0};
  double drift_m = 0;
  int n = 0;

  /// Formats "mean 0.0566 m (right -0.0400, down 0.0400, ahead 0.0000), scatter ... m; the error to the
  /// right changes by 0.45 mm from frame to frame"; the first number is the length of the mean.
  std::string text() const;
};

/// Computes the components; empty for fewer than two pairs. If all pairs have the same frame, the drift is 0.
std::optional<StepErrors> step_errors(const std::vector<int>& frames,
                                      const std::vector<Eigen::Vector3d>& errors_m);

}  // namespace sextant
