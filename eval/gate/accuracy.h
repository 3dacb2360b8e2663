#pragma once

// Errors and statuses, case by case: a case (seed, frame) of BASE against the same case of NEW. One row per
// subject (dataset, sequence, estimator, noise, level, body) and error, over the cases estimated on both
// sides, by stats/paired_comparison.h:
//
//   difference   mean of new - base, 0 where a case changed by no more than rounding. Clusters are the seeds;
//                with fewer than 6, of which no test can reject at 5 %, the cases
//   p_corrected  Holm over all rows that changed at all and could reach alpha (Tarone 1990: a test that
//                cannot reject takes nothing from the others)
//
// With the same seeds the same program gives the same numbers, so there is no noise between the two sides: a
// row is `regressed` where its mean got worse by more than minimum_effect and either no case got better or
// p_corrected <= alpha; `improved` the other way round; `inconclusive` where it got worse by so much with
// cases both ways and without evidence; else `ok`.
//
// Statuses: a case that was ok and is no longer is lost, the other way round gained. More lost than gained +
// max_lost is `regressed`, more gained `improved`. Truth that comes or goes is no change of the
// estimator's: it is a finding.

#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/sameness.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

/// p is none where nothing changed, p_corrected also where p could never reach alpha.
struct AccuracyRow : PairedComparison {
  Subject subject;
  std::string metric;
  int n = 0;         ///< cases estimated on both sides
  int n_worse = 0;   ///< beyond rounding
  int n_better = 0;  ///< beyond rounding
  double base = 0;   ///< mean
  GateVerdict verdict = GateVerdict::ok;
};

struct StatusRow {
  Subject subject;
  int n = 0;
  int n_lost = 0;
  int n_gained = 0;
  int n_other = 0;      ///< between two statuses that are not ok
  std::string example;  ///< "seed 0 frame 3: ok -> lost"
  GateVerdict verdict = GateVerdict::ok;
};

struct AccuracyComparison {
  std::vector<AccuracyRow> rows;
  std::vector<StatusRow> statuses;  ///< of subjects where any changed
  std::vector<Mismatch> findings;
  int n_cases = 0;  ///< on both sides
};

/// Both in order of subject.
AccuracyComparison compare_accuracy(const std::vector<SubjectCases>& base,
                                    const std::vector<SubjectCases>& fresh, const Policy& policy, int jobs);

}  // namespace sextant
