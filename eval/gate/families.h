#pragma once

// Errors pooled to what a maintainer asks for: has the camera, have the objects of this estimator got worse? A family is one
// error of the camera, or of all objects, of one estimator, over all sources, noise levels and bodies. Its change is a ratio
// of means (stats/paired_comparison.h) over
//
//   sample    a body at a noise level: compared with its own mean, so that large errors do not outweigh small ones
//   stratum   a source: data set and sequence; of each the seeds and the frames are random, across bodies and levels
//
// A body whose seeds are fewer than `minimum_seeds` is left out of a family that has others. Seeds with the same errors, as
// a deterministic estimator without noise has, count once.
//
//   regressed      worse by more than minimum_effect and proven: p_corrected <= alpha, or no case better and at least
//                  minimum_cases worse
//   inconclusive   worse by more than inconclusive_effect and not proven
//   improved       better by more than minimum_effect and proven
//   ok             otherwise
// With fewer than `minimum_seeds` seeds or `minimum_cases` cases p proves nothing; what would be proven by p, or would
// with more cases, is inconclusive.
// p_corrected: Holm over the errors of the cameras, and of the objects, of all estimators.

#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/subject_cases.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {

/// One error over the cases that both sides have estimated, and what was decided about it.
struct JudgedError {
  std::string metric;
  int n = 0;         ///< cases estimated on both sides
  int n_worse = 0;   ///< beyond rounding
  int n_better = 0;  ///< beyond rounding
  bool too_few = false;  ///< seeds or cases, to judge a change that would count
  GateVerdict verdict = GateVerdict::ok;

  bool is_changed() const { return n_worse + n_better > 0; }
  /// The verdict, or "too few to judge".
  std::string word() const;
};

/// One error of one subject: what families and rows are judged from.
struct PairedError : JudgedError {
  Subject subject;
  int n_seeds = 0;  ///< with different errors
  PairedSample cases;
};

struct FamilyRow : JudgedError, RatioChange {
  std::string estimator;
  std::string body;  ///< "camera" or "objects"
  int n_sources = 0;
  int n_seeds = 0;   ///< of the source that has fewest
  double worse = 0;  ///< the change in the direction that is worse
  std::optional<double> p_corrected;
};

/// Of metrics whose minimum_effect is above 0: the exact gate judges every row by itself. In order of weight: worst verdict
/// first, then the largest change for the worse, or for the better where it is improved.
std::vector<FamilyRow> judge_families(const std::vector<PairedError>& errors, const AccuracyPolicy& policy);

/// The change of the mean over these samples, under a policy.
RatioChange change_of(std::span<const PairedSample* const> samples, const MetricPolicy& rules,
                      const AccuracyPolicy& policy);

}  // namespace sextant
