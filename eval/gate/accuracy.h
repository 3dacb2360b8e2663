#pragma once

// Errors and statuses, case by case: a case (seed, frame) of BASE against the same case of NEW. What decides are errors
// pooled over sources and bodies (families.h). Below them stands one row per subject (dataset, sequence, estimator, noise,
// level, body) and error, over the cases estimated on both sides:
//
//   difference   mean of new - base, 0 where a case changed by no more than rounding
//   p            two-sided, by stats/paired_comparison.h, over seeds and frames
//   p_corrected  Holm over all rows that changed and are not too few to judge
//
// A row with `minimum_seeds` and `minimum_cases` is `regressed` where its mean got worse by more than minimum_effect with
// p_corrected <= alpha, `improved` the other way round, else `ok`. With fewer it is `ok`, and too_few where its mean
// changed by so much.
//
// The exact gate, minimum_effect 0. With the same seeds the same program gives the same numbers, so there is no noise
// between the two sides: a row is `regressed` where its mean got worse at all and no case got better or p_corrected <=
// alpha, and `inconclusive` where it got worse with cases both ways and without evidence. p is Wilcoxon's of the means
// per seed, with fewer than 6 of the cases; Holm is over all rows that could reach alpha (Tarone 1990: a test that cannot
// reject takes nothing from the others). A p that did not decide is not given.
//
// Statuses: a case that was ok and is no longer is lost, the other way round gained. More lost than gained +
// max_lost is `regressed`, more gained `improved`. Truth that comes or goes is no change of the
// estimator's: it is a finding.

#include <string>
#include <vector>

#include "sextant/eval/gate/families.h"
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
  bool too_few = false;  ///< its mean changed by more than counts; its seeds or cases are too few to judge

  /// The verdict, or "too few to judge".
  std::string word() const;
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
  std::vector<FamilyRow> families;  ///< in order of weight
  std::vector<AccuracyRow> rows;
  std::vector<StatusRow> statuses;  ///< of subjects where any changed
  std::vector<Mismatch> findings;
  int n_cases = 0;  ///< on both sides
};

/// Rows are in order of subject.
AccuracyComparison compare_accuracy(const std::vector<SubjectCases>& base,
                                    const std::vector<SubjectCases>& fresh, const Policy& policy, int jobs);

}  // namespace sextant
