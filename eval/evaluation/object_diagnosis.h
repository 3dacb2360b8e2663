#pragma once

// Diagnoses of logged object motions. Other readings of the log (eval/diagnosis) are compared with its truth,
// with its own poses, or with the true objects of a data set.
//
//   compared                                      diagnoses
//   motions of the log        true motions        the estimates, of all objects or of single ones
//   true motions              true poses          the truth of the log
//   motions of the log        poses of the log    the log's motions or poses
//   poses of the log          true poses          the log's poses
//   camera of the log         true camera         the log's cameras
//   whole log                 data set's truth    the log, before its objects are matched to true ones: each
//                                                 reading is compared with the true object that it fits best

#include <vector>

#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Compares the log with its own truth and its motions with its poses.
std::vector<LogDiagnosis> diagnose_log(const ObjectLog& log);

/// Compares the unmodified log with the truth of a data set.
std::vector<LogDiagnosis> diagnose_log(const ObjectLog& log, const SequenceTruth& truth);

}  // namespace sextant
