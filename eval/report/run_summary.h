#pragma once

// The summary of a run, from records alone: one row per dataset, sequence, estimator and body, under a metric
// preset, and the dynamic/static classification.
//
//   truth      pairs that have truth in both frames: for ego all of them, for objects those whose truth is
//              not static (dynamic_gt = 0 is left out; unknown is kept)
//   estimated  those of them with status ok;   coverage = estimated / truth
// The metrics, those `in_summary` of the list (metrics/definitions.h), are taken over `estimated`. Every
// record that is not ok is counted in `other`.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/noise_level.h"
#include "sextant/eval/report/table.h"
#include "sextant/metrics/definitions.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {

struct BodySummary {
  std::string dataset;
  std::string sequence;
  std::string estimator;
  std::string body;
  int n_pairs = 0;  ///< records of this body
  int n_truth = 0;
  int n_estimated = 0;
  std::optional<double> coverage;  ///< 0..1
  /// By name, those `in_summary` (metrics/definitions.h) that a record has; under the preset, "Et_m" of an
  /// object may be its Et_body_m.
  std::map<std::string, double> metrics;
  std::string other;  ///< "gated(distance) 3, lost 1"

  /// Whether the records of that level are behind this row.
  bool covers(const std::string& /*swept*/, const NoiseLevelKey& key) const {
    return key.dataset == dataset && key.sequence == sequence && key.estimator == estimator &&
           key.body == body;
  }
};

/// In order of dataset, sequence, estimator; ego first, then objects by id.
std::vector<BodySummary> summarize(const std::vector<Record>& records, const MetricPreset& preset);

/// One metric over estimated records of one kind of body: errors that the preset chooses by its aggregate,
/// all others by their mean; none where no record has it.
std::optional<double> summary_number(const RecordRefs& estimated, const MetricDefinition& metric,
                                     const MetricPreset& preset);

/// "gated(distance) 3, lost 1": records that are not ok, by status.
std::string other_statuses(const RecordRefs& records);

/// Over all object records that say both what was found and what is true and that no gate on distance or area
/// left out.
ClassificationCounts count_classification(const std::vector<Record>& records);

Table summary_table(const std::vector<Record>& records, const MetricPreset& preset);

/// summary_table() for a terminal of 100 columns: per dataset, sequence and estimator what matters first,
/// body, estimated, coverage, E_t, E_R, E_v and why pairs have no estimate, of the bodies with coverage; everything
/// with `all`, however wide.
std::string summary_text(const std::vector<Record>& records, const MetricPreset& preset, bool all);

/// {"schema","preset","aggregate","rows":[...],"classification":{...}}
Json summary_json(const std::vector<Record>& records, const MetricPreset& preset);

// ---- how halves of the bodies agree (`sextant run --consistency`).

/// By body: means of values.split_nees, of its two kinds and of values.nees, a line each; empty where no
/// record has split_nees.
std::string consistency_text(const std::vector<Record>& records);

}  // namespace sextant
