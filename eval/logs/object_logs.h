#pragma once

// Object motions as other systems log them.
//
//   dynosam  a folder with <m>_object_motion_log.csv and, where they are, <m>_object_pose_log.csv and
//            <m>_camera_pose_log.csv; lines frame_id,object_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,..,gt_qw (camera:
//            no object_id). Motions from frame k-1 to k in the world. An exact identity as truth is none
//   vdo      a folder as VDO-SLAM writes it, of two stages of one run: the front end (`initial`),
//            <p>obj_mot_<what>.txt and <p>initial_<what>.txt, and after its batch optimisation (`refined`),
//            <p>obj_mot_<what>_rf<what>.txt and <p>refined_<what>.txt. Motions: lines frame label and 16
//            values, in the object's own frame at k-1; cameras: frame and 16 values. Truth:
//            <p>obj_mot_gt.txt, <p>cam_pose_gt<what>.txt
//
// Limits and repairs as in trajectory_files.h.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/eval/logs/number_file.h"
#include "sextant/geometry/trajectory.h"
#include "sextant/truth/truth.h"

namespace sextant {

enum class MotionFrame { world, body };

struct LoggedMotion {
  SE3 estimate;
  std::optional<SE3> truth;
};

/// Object id and frame k (the current one of a motion).
using ObjectFrame = std::pair<int, int>;

struct ObjectLog {
  std::string estimator;  ///< the module <m>, or "vdo"
  MotionFrame frame = MotionFrame::world;
  std::map<ObjectFrame, LoggedMotion> motions;
  std::map<ObjectFrame, SE3> poses, true_poses;  ///< T_world_object
  Trajectory camera, true_camera;                ///< T_world_camera
  std::vector<std::string> warnings;
};

enum class LogFormat { dynosam, vdo };
constexpr Names<2> names_of(LogFormat) { return {"dynosam", "vdo"}; }

/// Of VDO-SLAM; any: the one whose motions are there.
enum class LogStage { any, initial, refined };
constexpr Names<3> names_of(LogStage) { return {"any", "initial", "refined"}; }

/// How logs are read.
struct ObjectLogRequest {
  LogFormat format = LogFormat::vdo;
  LogStage stage = LogStage::any;  ///< of vdo
  ReadRules rules;                 ///< of every file
  /// Which files of the folder count; empty: all.
  std::function<bool(const std::filesystem::path&)> accept;
};

/// One per module. Throws Error on folders without logs, on damaged files, and on vdo folders with motions of
/// both stages when none is asked for.
std::vector<ObjectLog> read_object_logs(const std::string& folder, const ObjectLogRequest& request);

/// T_world_object of logs that hold motions alone: each stretch of steps chained from the true pose before
/// it.
std::map<ObjectFrame, SE3> chained_poses(const ObjectLog& log);

/// Replaces the log's truth by that of a data set. The log's world may be another one: it is moved so that
/// both have the first camera pose they share. Ids of the log and of the truth may differ: each logged object
/// takes the id of the true one that it agrees with most over the steps they share, each true object once. A
/// step agrees, from 1 to 0, up to 3 m between the positions in the camera frame, or, where the log has no
/// poses, up to 0.5 m between the motions in the body frame. What agrees in fewer than 3 steps keeps no
/// truth.
void take_truth(ObjectLog& log, const SequenceTruth& truth);

}  // namespace sextant
