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

/// One case of one error on both sides, and where its records stand.
struct ErrorPair {
  SeedFrame at;
  double base = 0, fresh = 0;
  size_t base_line = 0, fresh_line = 0;  ///< of records.jsonl
};

/// p is none where nothing changed, p_corrected also where p could never reach alpha.
struct AccuracyRow : JudgedError, PairedComparison {
  Subject subject;
  double base = 0;                          ///< mean
  ErrorPair largest_rise, largest_fall;  ///< of all cases, rounding included

  /// The case that shows the change best.
  const ErrorPair& largest_change() const {
    return verdict == GateVerdict::improved ? largest_fall : largest_rise;
  }
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
  std::vector<FamilyRow> families;    ///< in order of weight
  std::vector<AccuracyRow> accuracy;  ///< in order of subject
  std::vector<StatusRow> statuses;    ///< of subjects where any changed
  std::vector<Mismatch> findings;
  int n_cases = 0;  ///< on both sides

  GateVerdict worst_verdict() const;
};

/// Adds to `out` the findings, and, where the policy judges errors, the rows.
void compare_accuracy(const std::vector<SubjectCases>& base, const std::vector<SubjectCases>& fresh,
                      const Policy& policy, int jobs, AccuracyComparison& out);

}  // namespace sextant
