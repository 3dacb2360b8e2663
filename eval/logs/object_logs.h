#pragma once

// Object motions in the log formats of other systems.
//
//   dynosam  a folder with <m>_object_motion_log.csv and, if available, <m>_object_pose_log.csv and
//            <m>_camera_pose_log.csv; lines frame_id,object_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,..,gt_qw (camera:
//            no object_id). Motions from frame k-1 to k in the world. An exact identity as truth means no
//            truth
//   vdo      a folder written by VDO-SLAM, with two stages of one run: the front end (`initial`),
//            <p>obj_mot_<what>.txt and <p>initial_<what>.txt, and the batch optimisation (`refined`),
//            <p>obj_mot_<what>_rf<what>.txt and <p>refined_<what>.txt. Motions: lines frame label and 16
//            values, in the object's own frame at k-1; cameras: frame and 16 values. Truth:
//            <p>obj_mot_gt.txt, <p>cam_pose_gt<what>.txt
//   motions  a file per object, obj_<id>_motion.* or obj_<id>.*, as written by `sextant run`: the motions
//            from frame k-1 to k in the frame given by the request (default: the world). Truth: the same name
//            with _gt before the extension. Lines "k" and 12 or 16 values (rows of [R|t]), or "t x y z qx qy
//            qz qw" with the time or the frame k, optionally followed by 12, 21 or 36 values of a covariance
//            (pose_collector.h)
//   poses    a file per object, obj_<id>_pose.* or obj_<id>.*, with the same lines: T_world_object. Matrices
//            may also stand without k; the rows are then frames 0, 1, 2, ..
//
// Cameras of `motions` and `poses`, with the lines of `poses`: est_camera_tum.txt, camera.txt or camera.tum;
// true cameras gt_camera_tum.txt, camera_gt.txt or camera_gt.tum.
//
// Structural faults are errors with file and line: a last row other than 0 0 0 1, a matrix that is not a
// rotation, frames that are repeated or not ascending within an object.
//
// Limits and repairs are those of trajectory_files.h.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
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

/// Lines of the entries of a file, for messages.
struct LogLines {
  std::string path;                        ///< file of all objects
  std::map<int, std::string> object_path;  ///< files of single objects
  std::map<ObjectFrame, int64_t> lines;    ///< line of each entry; cameras have the id 0

  std::string at(ObjectFrame key) const;  ///< returns "PATH:LINE"
};

/// Covariances of the error (position, rotation) of 4x4 matrices, with the convention of PoseSeries, and
/// their lines.
struct LogCovariances {
  struct Entry {
    PoseCovariance P;
    int line = 0;
  };
  std::map<ObjectFrame, Entry> entries;
  std::map<int, std::string> paths;  ///< files of the objects
};

struct ObjectLog {
  std::string estimator;  ///< the module <m>, "vdo", or the name of the folder
  MotionFrame frame = MotionFrame::world;
  bool from_camera = false;  ///< camera_motions_to_world() has converted the motions
  std::map<ObjectFrame, LoggedMotion> motions;
  std::map<ObjectFrame, SE3> poses, true_poses;         ///< T_world_object
  LogCovariances motion_covariances, pose_covariances;  ///< covariances of the estimates
  Trajectory camera, true_camera;                       ///< T_world_camera
  std::map<ObjectFrame, SE3> lost_truth;  ///< true motions without an estimate, in the frame of the log
  std::set<ObjectFrame> resting;  ///< steps in which the object rests by the data set's flag: without truth
  std::optional<double> rate_hz;  ///< from the log's time stamps
  LogLines motion_lines, pose_lines, camera_lines;  ///< lines of the truth
  bool truth_of_source = false;                     ///< take_truth() has replaced the log's own truth
  bool holds_poses_only = false;                    ///< the motions are computed from `poses`
  std::vector<std::string> warnings;

  /// Adds a true motion to the estimate of its step or, without one, to `lost_truth`.
  void add_truth(ObjectFrame key, const SE3& motion);
};

enum class LogFormat { dynosam, vdo, motions, poses };
constexpr Names<4> names_of(LogFormat) { return {"dynosam", "vdo", "motions", "poses"}; }

/// Stage of VDO-SLAM; any: the only stage whose motions are in the folder.
enum class LogStage { any, initial, refined };
constexpr Names<3> names_of(LogStage) { return {"any", "initial", "refined"}; }

/// Request for reading logs.
struct ObjectLogRequest {
  LogFormat format = LogFormat::vdo;
  LogStage stage = LogStage::any;                   ///< stage of vdo
  std::optional<MotionFrame> frame = std::nullopt;  ///< frame of motions, if it is not that of the format
  /// converts time stamps to frame numbers; nullopt: computed from the stamps
  std::optional<double> rate_hz = std::nullopt;
  ReadRules rules;  ///< for every file
  /// Returns true for files of the folder that may be read; an empty function accepts all.
  std::function<bool(const std::filesystem::path&)> accept;
};

/// Reads the logs of a folder: one per module for dynosam, otherwise a single one. Throws Error on folders
/// without logs, on damaged files, on vdo folders with motions of both stages if no stage is requested, and
/// if a stage is requested of another format, or a frame for `poses`.
std::vector<ObjectLog> read_object_logs(const std::string& folder, const ObjectLogRequest& request);

/// Converts motions declared in the camera frame (T_curr_prev) to the world; logs with another declared frame
/// stay unchanged. Estimates are converted with the log's camera poses or, if it has none, with `truth`; true
/// motions with `truth` or, if it is empty, with the log's true camera, then with its estimated one. Motions
/// without the two camera poses are removed, and covariances of motions are dropped with a warning. Throws
/// Error if no motion is left.
void camera_motions_to_world(ObjectLog& log, const Trajectory& truth = {});

/// Returns the poses T_world_object to which the motions lead, for logs without poses. Each sequence of
/// successive steps is chained from the first of its frames that has a true pose; earlier steps are left out.
std::map<ObjectFrame, SE3> chained_poses(const ObjectLog& log);

/// Returns false if all poses are exactly the identity, which stands for missing poses.
bool holds_poses(const Trajectory& camera);

/// Moves the estimates of the log (camera, poses, motions and their covariances) into the world of `camera`,
/// so that both agree in their first common camera pose. The log's true camera is used for this if it is
/// known, otherwise the estimated one. A log without cameras must already be in that world.
void move_to_world_of(const Trajectory& camera, ObjectLog& log);

}  // namespace sextant
