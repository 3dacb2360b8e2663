#pragma once

// Compares the statuses of records, and their decisions between dynamic and static, record by record.
//
// Statuses: a record that was estimated in BASE (status ok or no_truth) and is not in NEW is lost; the
// opposite is gained. Records of bodies that are static by truth are neither: they count in no coverage. A
// gained record with an error above gained_error times the largest one of the subject in BASE is bad and
// counts as lost: a grossly wrong estimate is no gain. A subject with more than gained + max_lost lost
// records is
//
//   regressed      if no record of its family (the camera, or the objects, of its estimator) is gained while
//                  at least half of the errors of the family are unchanged, or if the loss of the subject or
//                  of the family is proven: p <= alpha, both of the sign test of the records, times the
//                  number of subjects, and of Wilcoxon's test of the seeds
//   inconclusive   if p <= 0.05, or if it has too few seeds for a proof and lost more than twice as many
//                  records as it gained
//   ok             otherwise: an estimator with random numbers of its own, which also change most of its
//                  errors, loses a record now and then, or loses some and gains others
//
// With more records gained than lost it is `improved` by the same rule, with lost and gained exchanged,
// otherwise `ok`. A subject that both sides have estimated, but in no common record although chance would
// give three, has no error to compare: it is `inconclusive` unless it is `regressed`. Truth that appears or
// disappears is not a change of the estimator; it is a finding.
//
// Decisions: a record whose value `dynamic` differs from `dynamic_gt` in NEW but not in BASE has become
// wrong; the opposite is corrected. They are judged like lost and gained records, and a subject has the worse
// of the two verdicts. Decisions of bodies that are gated for another reason (distance, area) are not judged.

#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/subject_cases.h"

namespace sextant {

/// Changes of status, and of the decision between dynamic and static, of one subject.
struct StatusRow {
  Subject subject;
  int n = 0;
  int n_lost = 0;
  int n_gained = 0;
  int n_bad = 0;  ///< estimated in NEW only, with a gross error; they count as lost
  /// Cases that neither side estimated or that are static by truth, with another status or another Gate; and
  /// other decisions that differ but are not judged: without truth, of a body gated for another reason, or
  /// made by one side only
  int n_other = 0;
  int n_wrong = 0;      ///< decisions that are wrong in NEW, but not in BASE
  int n_corrected = 0;  ///< decisions that are wrong in BASE, but not in NEW
  std::string example;  ///< "seed 0 frame 3: ok -> lost"
  GateVerdict verdict = GateVerdict::ok;
};

/// Returns the subjects with any change of status or decision, in the order of `shared`.
std::vector<StatusRow> compare_statuses(const std::vector<PairedCases>& shared, const AccuracyPolicy& policy);

}  // namespace sextant
