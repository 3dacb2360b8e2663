#pragma once

// The summary of a run, from records alone: one row per dataset, sequence, estimator and body, under a metric
// preset, and the dynamic/static classification.
//
//   truth      pairs that have truth in both frames: for ego all of them, for objects those whose truth is
//              not static (dynamic_gt = 0 is left out; unknown is kept)
//   estimated  those of them with status ok;   coverage = estimated / truth
// Errors, velocities and EPE are taken over `estimated`. Errors use the preset's aggregate, velocities and
// EPE are means. Every record that is not ok is counted in `other`.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/table.h"
#include "sextant/metrics/classification_counts.h"
#include "sextant/metrics/presets.h"

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
  std::optional<double> Et_m;
  std::optional<double> ER_deg;
  std::optional<double> Ev_kmh;
  std::optional<double> v_kmh;
  std::optional<double> v_gt_kmh;
  std::optional<double> epe_initial_px;
  std::optional<double> epe_refined_px;
  std::string other;  ///< "gated(distance) 3, lost 1"
};

/// In order of dataset, sequence, estimator; ego first, then objects by id.
std::vector<BodySummary> summarize(const std::vector<Record>& records, const MetricPreset& preset);

/// Over all object records that say both what was found and what is true and that no gate on distance or area
/// left out.
ClassificationCounts count_classification(const std::vector<Record>& records);

Table summary_table(const std::vector<Record>& records, const MetricPreset& preset);

/// {"schema","preset","aggregate","rows":[...],"classification":{...}}
Json summary_json(const std::vector<Record>& records, const MetricPreset& preset);

}  // namespace sextant
