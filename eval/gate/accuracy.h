#pragma once

// Compares errors and statuses case by case: a case (seed, frame) of BASE with the same case of NEW. The
// verdict is decided by errors pooled over sources and bodies (families, below). In addition there is one row
// per subject (data set, sequence, estimator, noise, level, body) and error, over the cases estimated on both
// sides:
//
//
//   difference   mean of new - base; a case that changed by no more than rounding contributes 0
//   p            two-sided p-value over seeds and frames, by stats/paired_comparison.h
//   p_corrected  Holm correction over all rows that changed and have enough cases to judge
//
// A row with at least `minimum_seeds` and `minimum_cases` is `regressed` if its mean got worse by more than
// minimum_effect with p_corrected <= alpha, `improved` if it got better in the same way, and otherwise `ok`.
// A row with fewer is `ok`, and has too_few set if its mean changed by that much.
//
// The exact gate (minimum_effect 0): the same program gives the same numbers for the same seeds, so there is
// no noise between the two sides. A row is `regressed` if its mean got worse at all and either no case got
// better or p_corrected <= alpha. It is `inconclusive` if its mean got worse, with cases that got better and
// without that evidence. p is Wilcoxon's test of the means per seed, or of the cases if there are fewer than
// 6 seeds. Holm's correction covers all rows that could reach alpha (Tarone 1990: a test that cannot reject
// does not count for the others). A p-value that did not decide is not reported.
//
// Statuses: a case that was ok in BASE and is not in NEW is lost; the opposite is gained. More lost cases
// than gained + max_lost are `regressed`, more gained cases `improved`. Truth that appears or disappears is
// not a change of the estimator; it is a finding.

#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"
#include "sextant/eval/gate/subject_cases.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

// ---- Pools errors to answer a maintainer's question: has the camera, or have the objects, of this estimator
// got worse? A family is one error of the camera, or of all objects, of one estimator, over all sources,
// noise levels and bodies. Its change is a ratio of means (stats/paired_comparison.h) over
//
//
//   sample    a body at a noise level, relative to its own mean, so that large errors do not outweigh small
//             ones
//   stratum   a source (data set and sequence); its seeds and frames are random effects that bodies and
//             levels share
//
// A body with fewer than `minimum_seeds` seeds is left out of a family that has other bodies. Seeds with
// identical errors, as of a deterministic estimator without noise, count once.
//
//   regressed      worse by more than minimum_effect and proven: p_corrected <= alpha, or no case better and
//                  at least minimum_cases worse
//   inconclusive   worse by more than inconclusive_effect and not proven
//   improved       better by more than minimum_effect and proven
//   ok             otherwise
//
// With fewer than `minimum_seeds` seeds or `minimum_cases` cases a p-value is no proof; a change that p would
// prove, or that more cases could prove, is inconclusive. p_corrected is Holm's correction over the errors of
// the cameras, or of the objects, of all estimators.

/// One error over the cases that both sides have estimated, with its verdict.
struct JudgedError {
  std::string metric;
  int n = 0;             ///< cases estimated on both sides
  int n_worse = 0;       ///< by more than rounding
  int n_better = 0;      ///< by more than rounding
  bool too_few = false;  ///< too few seeds or cases to judge a change that would count
  GateVerdict verdict = GateVerdict::ok;

  bool is_changed() const { return n_worse + n_better > 0; }
  /// Returns the verdict, or "too few to judge".
  std::string word() const;
};

/// One error of one subject; families and rows are judged from these.
struct PairedError : JudgedError {
  Subject subject;
  int n_seeds = 0;  ///< number of seeds with different errors
  PairedSample cases;
};

/// Change of one family.
struct FamilyRow : JudgedError, RatioChange {
  std::string estimator;
  std::string body;  ///< "camera" or "objects"
  int n_sources = 0;
  int n_seeds = 0;   ///< number of seeds of the source that has fewest
  double worse = 0;  ///< the change, positive if worse
  std::optional<double> p_corrected;
};

/// Judges the metrics whose minimum_effect is above 0; the exact gate judges every row separately. Returns
/// the worst verdict first, then the largest worsening, or the largest improvement among improved families.
std::vector<FamilyRow> judge_families(const std::vector<PairedError>& errors, const AccuracyPolicy& policy);

/// Computes the change of the mean over these samples under a policy.
RatioChange change_of(std::span<const PairedSample* const> samples, const MetricPolicy& rules,
                      const AccuracyPolicy& policy);

/// One case of one error on both sides, with the lines of its records.
struct ErrorPair {
  SeedFrame at;
  double base = 0, fresh = 0;
  size_t base_line = 0, fresh_line = 0;  ///< line in records.jsonl
};

/// One error of one subject. p is empty if nothing changed; p_corrected is also empty if p could never reach
/// alpha.
struct AccuracyRow : JudgedError, PairedComparison {
  Subject subject;
  double base = 0;                    ///< mean
  ErrorPair most_worse, most_better;  ///< over all cases, including changes within rounding

  /// Returns the case that improved most if the row is improved, otherwise the case that worsened most.
  const ErrorPair& largest_change() const {
    return verdict == GateVerdict::improved ? most_better : most_worse;
  }
};

/// Changes of status of one subject.
struct StatusRow {
  Subject subject;
  int n = 0;
  int n_lost = 0;
  int n_gained = 0;
  int n_other = 0;      ///< changes between two statuses that are not ok
  std::string example;  ///< "seed 0 frame 3: ok -> lost"
  GateVerdict verdict = GateVerdict::ok;
};

/// Rows and findings of a comparison of errors.
struct AccuracyComparison {
  std::vector<FamilyRow> families;    ///< worst first
  std::vector<AccuracyRow> accuracy;  ///< in order of subject
  std::vector<StatusRow> statuses;    ///< subjects with any change of status
  std::vector<Mismatch> findings;
  int n_cases = 0;  ///< number of cases on both sides

  GateVerdict worst_verdict() const;
};

/// Adds the findings to `out` and, if the policy judges errors, the rows.
void compare_accuracy(const std::vector<SubjectCases>& base, const std::vector<SubjectCases>& fresh,
                      const Policy& policy, int jobs, AccuracyComparison& out);

}  // namespace sextant
