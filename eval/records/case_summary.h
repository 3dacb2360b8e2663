#pragma once

// What a sweep with "keep": "summary" keeps of a case (one source, estimator, noise level and seed): counts, sums and
// histograms of its records, body by body. A seed's values belong together in all intervals, so that means, RMSE, coverage,
// trends and their intervals follow from these as from the records; quantiles within 0.5 %.
//
// Over the records with status ok and truth ("estimated"):
//   errors      of each `compared` error (metrics/definitions.h) n, sum, sum of squares, histogram
//   limits      of each bounded error, over the records that have error and bound: n, the bound's sum of squares, the error's sums
//   nees, epe_initial_px (where true flow is given), distance_gt_m (where Et_m is there): n and sum

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/stats/sample_sums.h"

namespace sextant {

struct MeanSums {
  uint64_t n = 0;
  double sum = 0;
  void add(double value) {
    ++n;
    sum += value;
  }
  bool operator==(const MeanSums&) const = default;
};

struct LimitSums {
  uint64_t n = 0;
  double bound_squares = 0;
  double error_sum = 0;
  double error_squares = 0;
  bool operator==(const LimitSums&) const = default;
};

/// One body of a case.
struct BodySums {
  int body = 0;  ///< 0: ego, else the object's id
  std::map<std::pair<Status, Gate>, uint64_t> statuses;
  uint64_t n_estimated = 0;  ///< status ok and truth
  std::vector<int> missed;   ///< frames with truth, not estimated; rising
  std::map<std::string, SampleSums> errors;
  std::map<std::string, LimitSums> limits;  ///< by the error's name
  MeanSums nees, epe_initial_px, distance_gt_m;

  uint64_t n_records() const;
  uint64_t n_truth() const { return n_estimated + missed.size(); }
  bool operator==(const BodySums&) const = default;
};

/// One result of the case's estimator: it has several when a program outside gives several.
struct ResultSums {
  std::string estimator;  ///< as in records
  std::vector<BodySums> bodies;  ///< in order of body
  bool operator==(const ResultSums&) const = default;
};

struct CaseSummary {
  std::string dataset, sequence, noise;
  double level = 0;
  uint64_t seed = 0;
  std::vector<ResultSums> results;

  uint64_t n_records() const;
  bool operator==(const CaseSummary&) const = default;
};

/// Of the records of one case.
CaseSummary summarize_case(const std::vector<Record>& records);

std::string encode_case_summary(const CaseSummary& summary);
/// Throws Error that begins with `where` when the bytes are none.
CaseSummary decode_case_summary(std::string_view bytes, const std::string& where);

}  // namespace sextant
