#pragma once

// Diagnoses of logged object motions. Other readings of the log (eval/diagnosis) are compared with its truth,
// with its own poses, or with the true objects of a data set; speeds that no vehicle reaches are reported.
//
//   compared                                      diagnoses
//   motions of the log        true motions        the estimates, of all objects or of single ones
//   true motions              true poses          the truth of the log
//   motions of the log        poses of the log    the log's motions or poses
//   poses of the log          true poses          the log's poses
//   camera of the log         true camera         the log's cameras
//   whole log                 data set's truth    the log, before its objects are matched to true ones: each
//                                                 reading is compared with the true object that it fits best

#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// A diagnosis with its cause and the correction in `text`; `code` as in motion_readings.h and
/// pose_readings.h.
struct LogDiagnosis {
  std::string code;
  std::string text;
};

/// Compares the log with its own truth and its motions with its poses.
std::vector<LogDiagnosis> diagnose_log(const ObjectLog& log);

/// Compares the unmodified log with the truth of a data set.
std::vector<LogDiagnosis> diagnose_log(const ObjectLog& log, const SequenceTruth& truth);

/// Throws Error that names the line if the log's own truth moves an object at more than 100 m/s, or if
/// successive true poses of an object or of the camera are more than 50 m apart at 10 Hz (500 m/s). The
/// message includes the diagnoses `found`.
void check_plausible(const ObjectLog& log, double rate_hz, const std::vector<LogDiagnosis>& found);

/// Reports objects whose median estimated speed is above 100 m/s, which no vehicle reaches.
std::vector<LogDiagnosis> diagnose_speeds(const ObjectLog& log, double rate_hz);

/// Returns by object the steps whose estimate is the identity (within 1e-6) although the object moves, as
/// written by a tracker that failed (DynOSAM's issue 20). Objects without such steps are left out.
std::map<int, std::vector<int>> identity_steps(const ObjectLog& log);

/// Returns by object the steps without an estimate between the first and the last step that has an estimate
/// or truth. If the truth is that of a data set (take_truth()), only steps with truth count.
std::map<int, std::vector<int>> missing_steps(const ObjectLog& log);

/// Formats ascending frame numbers as ranges, e.g. "20-29, 40", with at most `most` groups and the number of
/// further ones.
std::string ranges_text(const std::vector<int>& frames, size_t most = 6);

}  // namespace sextant
