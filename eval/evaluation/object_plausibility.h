#pragma once

// Plausibility of logged object motions by themselves, without another reading of the log: speeds that no
// vehicle reaches, estimates that are the identity, and steps without an estimate.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"

namespace sextant {

/// A diagnosis with its cause and the correction in `text`; `code` as in motion_readings.h and
/// pose_readings.h.
struct LogDiagnosis {
  std::string code;
  std::string text;
};

/// Returns the true motions of a log, also those without an estimate.
std::map<ObjectFrame, SE3> true_motions(const ObjectLog& log);

/// Returns the poses of a camera in the form of an object's path, with id 0.
std::map<ObjectFrame, SE3> camera_poses(const Trajectory& camera);

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
