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
//   motions  a file an object, obj_<id>_motion.* or obj_<id>.*, as `sextant run` writes it: the motions from
//            frame k-1 to k, of the frame that the request gives (the world, else). Truth: the same name with
//            _gt before the extension. Lines "k" and 12 or 16 values (rows of [R|t]), or "t x y z qx qy qz
//            qw" with the time or the frame k, and maybe 12, 21 or 36 values of a covariance
//            (pose_covariance.h)
//   poses    a file an object, obj_<id>_pose.* or obj_<id>.*, in the same lines: T_world_object
//            of both: cameras est_camera_tum.txt or camera.*, true ones gt_camera_tum.txt or camera_gt.*
//
// Structural faults are errors with file and line: a last row other than 0 0 0 1, what is no rotation, frames
// that come twice or do not ascend within an object.
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
#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/eval/logs/number_file.h"
#include "sextant/geometry/trajectory.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct LoggedMotion {
  SE3 estimate;
  std::optional<SE3> truth;
};

/// Where the entries of a file stand, for messages.
struct LogLines {
  std::string path;                        ///< of all objects
  std::map<int, std::string> object_path;  ///< where each has a file of its own
  std::map<ObjectFrame, int64_t> lines;    ///< of cameras: object 0

  std::string at(ObjectFrame key) const;  ///< "PATH:LINE"
};

/// Covariances of the error (position, rotation) of 4x4 matrices, as PoseSeries has them, each with its line.
struct LogCovariances {
  struct Entry {
    PoseCovariance P;
    int line = 0;
  };
  std::map<ObjectFrame, Entry> entries;
  std::map<int, std::string> paths;  ///< of objects
};

struct ObjectLog {
  std::string estimator;  ///< the module <m>, "vdo", or the name of the folder
  MotionFrame frame = MotionFrame::world;
  std::map<ObjectFrame, LoggedMotion> motions;
  std::map<ObjectFrame, SE3> poses, true_poses;         ///< T_world_object
  LogCovariances motion_covariances, pose_covariances;  ///< of the estimates
  Trajectory camera, true_camera;                       ///< T_world_camera
  std::map<ObjectFrame, SE3> lost_truth;  ///< true motions that have no estimate, in the frame of the log
  std::optional<double> rate_hz;          ///< of the log's time stamps
  LogLines motion_lines, pose_lines, camera_lines;  ///< of the truth
  bool truth_of_source = false;                     ///< take_truth() has replaced the log's own
  std::vector<std::string> warnings;
};

enum class LogFormat { dynosam, vdo, motions, poses };
constexpr Names<4> names_of(LogFormat) { return {"dynosam", "vdo", "motions", "poses"}; }

/// Of VDO-SLAM; any: the one whose motions are there.
enum class LogStage { any, initial, refined };
constexpr Names<3> names_of(LogStage) { return {"any", "initial", "refined"}; }

/// How logs are read.
struct ObjectLogRequest {
  LogFormat format = LogFormat::vdo;
  LogStage stage = LogStage::any;                   ///< of vdo
  std::optional<MotionFrame> frame = std::nullopt;  ///< of motions, where it is not the format's own
  std::optional<double> rate_hz = std::nullopt;     ///< time stamps to frame numbers; empty: from the stamps
  ReadRules rules;                                  ///< of every file
  /// Which files of the folder count; empty: all.
  std::function<bool(const std::filesystem::path&)> accept;
};

/// One per module. Throws Error on folders without logs, on damaged files, and on vdo folders with motions of
/// both stages when none is asked for.
std::vector<ObjectLog> read_object_logs(const std::string& folder, const ObjectLogRequest& request);

/// Turns motions that are declared in the camera frame (T_curr_prev) to the world, by the log's cameras, else
/// by `truth`. Throws Error when no motion has its two camera poses. Other logs stay as they are.
void camera_motions_to_world(ObjectLog& log, const Trajectory& truth = {});

/// T_world_object of logs that hold motions alone: each stretch of steps chained from the true pose before
/// it.
std::map<ObjectFrame, SE3> chained_poses(const ObjectLog& log);

/// Puts the log into the world of `camera`, so that both have the first camera pose they share. A log without
/// cameras must be there already.
void move_to_world_of(const Trajectory& camera, ObjectLog& log);

/// T_world_object of the objects that are not declared static.
std::map<ObjectFrame, SE3> true_object_poses(const SequenceTruth& truth);

/// Replaces the log's truth by that of a data set. The log's world may be another one: it is moved so that
/// both have the first camera pose they share. Ids of the log and of the truth may differ: each logged object
/// takes the id of the true one that it agrees with most over the steps they share, each true object once. A
/// step agrees, from 1 to 0, up to 3 m between the positions in the camera frame, or, where the log has no
/// poses, up to 0.5 m between the motions in the body frame. What agrees in fewer than 3 steps keeps no
/// truth.
void take_truth(ObjectLog& log, const SequenceTruth& truth);

}  // namespace sextant
