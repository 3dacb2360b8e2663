#pragma once

// Pools errors to answer a maintainer's question: has the camera, or have the objects, of this estimator got
// worse? A family is one error of the camera, or of all objects, of one estimator, over all sources, noise
// levels and bodies. Its change is a ratio of means (stats/paired_comparison.h) over
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

#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/subject_cases.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

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

}  // namespace sextant
