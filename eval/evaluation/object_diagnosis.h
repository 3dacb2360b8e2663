#pragma once

// What looks wrong about logged object motions: other readings of the log (eval/diagnosis) against its truth, against
// its own paths of poses, or against the true objects of a data set; speeds that no vehicle has.
//
//   compared                                      says something about
//   motions of the log        true motions        the estimates (of all objects, of single ones)
//   true motions              true poses          the truth of the log
//   motions of the log        poses of the log    both, where there is no truth to ask
//   poses of the log          true poses          the log's poses
//   camera of the log         true camera         the log's cameras
//   all of the log            a data set's truth  the log: before its objects are matched to true ones, each
//                                                 reading takes the object that it fits best

#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// A diagnosis that names its cause and the correction; `code` as in motion_readings.h and pose_readings.h.
struct LogDiagnosis {
  std::string code;
  std::string text;
};

/// Compares the log with its own truth and with itself.
std::vector<LogDiagnosis> diagnose_log(const ObjectLog& log);

/// Compares the log, as read, with the truth of a data set.
std::vector<LogDiagnosis> diagnose_log(const ObjectLog& log, const SequenceTruth& truth);

/// Throws Error that names the line where the log's own truth moves an object at more than 100 m/s, or puts
/// successive poses more than 50 m apart at 10 Hz (500 m/s); `found` explains it where a diagnosis does.
void check_plausible(const ObjectLog& log, double rate_hz, const std::vector<LogDiagnosis>& found);

/// Estimates that no vehicle drives: objects whose median estimated speed is above 100 m/s.
std::vector<LogDiagnosis> diagnose_speeds(const ObjectLog& log, double rate_hz);

/// Steps of an object at which its estimate is exactly the identity although it moves: a tracker that gave up
/// (DynOSAM's issue 20). An object that stands in all steps has none.
std::map<int, std::vector<int>> identity_steps(const ObjectLog& log);

/// Steps between an object's first and last frame that have no estimate, by object.
std::map<int, std::vector<int>> missing_steps(const ObjectLog& log);

/// "20-29, 40": successive numbers together, at most `most` groups.
std::string ranges_text(const std::vector<int>& frames, size_t most = 6);

}  // namespace sextant
