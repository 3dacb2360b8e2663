#pragma once

// Compares errors record by record: a record (seed, frame) of BASE with the same record of NEW.
// The verdict is decided by errors pooled over sources and bodies (families, below). In addition there is one
// row per subject (data set, sequence, estimator, noise, level, body) and error, over the records estimated
// on both sides:
//
//   difference   mean of new - base; a record that changed by no more than rounding contributes 0
//   p            two-sided p-value over seeds and frames, by stats/paired_comparison.h
//   p_corrected  Holm correction over all rows that changed and have enough seeds and records to judge
//
// A row with at least `minimum_seeds` seeds, two frames and `minimum_cases` records is `regressed` if its
// mean got worse by more than minimum_effect with p_corrected <= alpha, `improved` if it got better in the
// same way, and otherwise `ok`. A row with fewer of them is `ok`; too_few is set if its mean changed by
// more than minimum_effect.
//
// The exact gate (minimum_effect 0): the same program gives the same numbers for the same seeds, so there is
// no noise between the two sides. A row is `regressed` if its mean got worse at all and either no record got
// better or p_corrected <= alpha. It is `inconclusive` if its mean got worse, some records got better, and
// p_corrected is above alpha or empty. It is `improved` if its mean got better and either no record got worse
// or p_corrected <= alpha. p is Wilcoxon's test of the means per seed, or of the records if there are fewer
// than 6 seeds. Holm's correction covers all rows that could reach alpha (Tarone 1990: a test that cannot
// reject does not count for the others). If a verdict `regressed` or `improved` does not follow from p, p is
// not reported.
//
#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"
#include "sextant/eval/gate/statuses.h"
#include "sextant/eval/gate/subject_cases.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

// ---- Pools errors to answer a maintainer's question: has the camera, or have the objects, of this estimator
// got worse? A family is one error of the camera, or of all objects, of one estimator, over all sources,
// noise levels and bodies. Its change is a ratio of means (stats/paired_comparison.h) over
//
//   sample    a body at a noise level, relative to its own mean, so that large errors do not outweigh small
//             ones
//   stratum   a source (data set and sequence); its seeds and frames are random effects that bodies and
//             levels share
//
// A body with fewer than `minimum_seeds` seeds or a single frame is left out of a family in which other
// bodies have enough. Seeds with identical errors, as of a deterministic estimator without noise, count
// once. The bodies that are left out are pooled by themselves, and listed if they are `regressed`.
//
//   regressed      worse by more than minimum_effect and proven: p_corrected <= alpha, or no record better
//                  and at least minimum_cases worse, by more than 50 % or in so many frames that a sign test
//                  of the frames reaches alpha (8 for 0.01). Frames in which nothing changed do not count
//   inconclusive   not proven, and worse by more than inconclusive_effect, or the typical record is worse:
//                  the median of new / base by more than 25 %, in Wilcoxon's tests of the medians of the
//                  seeds (p <= alpha) and of those of the frames (p <= 0.05)
//   improved       better by more than minimum_effect and proven
//   ok             otherwise
//
// With fewer than `minimum_seeds` seeds, two frames or `minimum_cases` records a p-value is no proof. An
// error that is then worse by more than minimum_effect, with p_corrected <= alpha or without any record
// that got better, is inconclusive. p_corrected is Holm's correction over the errors of the cameras, or of
// the objects, of all estimators.

/// One error over the records that both sides have estimated, with its verdict.
struct JudgedError {
  std::string metric;
  int n = 0;         ///< records estimated on both sides
  int n_worse = 0;   ///< by more than rounding
  int n_better = 0;  ///< by more than rounding
  /// Too few seeds, frames or records to judge; in a row also: its mean changed by more than minimum_effect
  bool too_few = false;
  GateVerdict verdict = GateVerdict::ok;

  bool is_changed() const { return n_worse + n_better > 0; }
  /// Returns the verdict, or "too few to judge".
  std::string word() const;
};

/// Change of one family.
struct FamilyRow : JudgedError, RatioChange {
  std::string estimator;
  std::string body;  ///< "camera" or "objects"
  int n_sources = 0;
  int n_seeds = 0;           ///< smallest number of seeds with different errors among its bodies
  int n_changed_frames = 0;  ///< frames with a record that changed, over all sources
  double worse = 0;          ///< the change, with the sign that is positive if the error got worse
  bool typically_worse = false;
  std::optional<double> p_corrected;
};

/// One error of one record on both sides.
struct ErrorPair {
  SeedFrame at;
  double base = 0, fresh = 0;
  size_t base_line = 0, fresh_line = 0;  ///< line in records.jsonl
};

/// One error of one subject. p is empty if no record changed, if there is only one record (outside of the
/// exact gate), or if a verdict `regressed` or `improved` does not follow from p. p_corrected is also empty
/// if there are too few seeds or records, or, in the exact gate, if p could not reach alpha.
struct AccuracyRow : JudgedError, PairedComparison {
  Subject subject;
  double base = 0;                    ///< mean in BASE
  ErrorPair most_worse, most_better;  ///< over all records, including changes within rounding

  /// Returns the record that improved most if the row is improved, otherwise the record that worsened most.
  const ErrorPair& largest_change() const {
    return verdict == GateVerdict::improved ? most_better : most_worse;
  }
};

/// Rows and findings of a comparison of errors.
struct AccuracyComparison {
  std::vector<FamilyRow> families;    ///< worst first
  std::vector<AccuracyRow> accuracy;  ///< in order of subject
  std::vector<StatusRow> statuses;    ///< subjects with any change of status or decision
  std::vector<Mismatch> findings;
  int n_cases = 0;  ///< number of records that both sides have

  GateVerdict worst_verdict() const;
};

/// Adds the findings to `out` and, if the policy judges errors and statuses, the families and rows.
void compare_accuracy(const Subjects& base, const Subjects& fresh, const Policy& policy, int jobs,
                      AccuracyComparison& out);

}  // namespace sextant
