#include "sextant/eval/logs/object_logs.h"

#include <algorithm>

#include "sextant/base/quantile.h"
#include "sextant/eval/logs/object_log_files.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {
namespace {

void expect(const NumberFile& file, size_t n, const char* what) {
  if (file.separator() == ',' && header_contradicts(file.header(), what))
    file.fail_here("the header names other columns than {}, or another order", what);
  if (file.values().size() != n) file.fail_here("expected {}, got {} values", what, file.values().size());
}

constexpr const char* dynosam_object =
    "frame_id,object_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw";

/// Calls add(id and frame, estimate, truth unless it is an exact identity) for each line.
template <typename Add>
void read_dynosam_objects(const LogFolder& folder, const std::string& name, ObjectLog& out, LogLines& lines,
                          const Add& add) {
  FrameOrder order;
  for_each_record(folder, name, ',', out, [&](const NumberFile& file, RepairLog& repairs) {
    expect(file, 16, dynosam_object);
    const ObjectFrame key = {file.whole(1, "an object id"), file.whole(0)};
    const SE3 estimate = quaternion_pose(file, 2, repairs), truth = quaternion_pose(file, 9, repairs);
    if (is_identity(truth))
      repairs.note("the truth is exactly the identity: treated as missing", file.line());
    order.check(file, key, "object", &lines);
    add(key, estimate, is_identity(truth) ? std::nullopt : std::optional(truth));
  });
}

void read_dynosam_cameras(const LogFolder& folder, const std::string& name, ObjectLog& out) {
  FrameOrder order;
  for_each_record(folder, name, ',', out, [&](const NumberFile& file, RepairLog& repairs) {
    expect(file, 15, "frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw");
    const int frame = file.whole(0);
    order.check(file, {0, frame}, "camera", &out.camera_lines);
    out.camera.set(frame, quaternion_pose(file, 1, repairs));
    out.true_camera.set(frame, quaternion_pose(file, 8, repairs));
  });
}

/// Computes the rate from the median time between frames, given in lines frame_id,timestamp [ns]. Stamps are
/// subtracted as integers: a double of s since 1970 has steps of 0.2 us.
void read_dynosam_times(const LogFolder& folder, const std::string& name, ObjectLog& out) {
  struct StampedFrame {
    int frame = 0;
    std::optional<int64_t> exact_ns;
    double ns = 0;

    double ns_since(const StampedFrame& before) const {
      int64_t difference = 0;
      const bool is_exact =
          exact_ns && before.exact_ns && !__builtin_sub_overflow(*exact_ns, *before.exact_ns, &difference);
      return is_exact ? static_cast<double>(difference) : ns - before.ns;
    }
  };
  std::vector<double> steps_s;
  std::optional<StampedFrame> last;
  for_each_record(folder, name, ',', out, [&](const NumberFile& file, RepairLog&) {
    if (file.values().size() != 2) file.fail_here("expected frame_id,timestamp [ns]");
    const StampedFrame now{file.whole(0), file.integer(1), file.values()[1]};
    if (last && now.frame > last->frame)
      steps_s.push_back(now.ns_since(*last) / 1e9 / (now.frame - last->frame));
    last = now;
  });
  if (steps_s.empty()) return;
  const double step_s = upper_median(steps_s);
  if (step_s > 0) out.rate_hz = 1 / step_s;
}

std::vector<ObjectLog> read_dynosam(const LogFolder& folder) {
  constexpr std::string_view suffix = "_object_motion_log.csv";
  std::vector<ObjectLog> logs;
  for (const std::string& name : folder.names()) {
    if (!name.ends_with(suffix)) continue;
    ObjectLog log;
    log.estimator = name.substr(0, name.size() - suffix.size());
    const std::string poses = log.estimator + "_object_pose_log.csv";
    const std::string cameras = log.estimator + "_camera_pose_log.csv";
    read_dynosam_objects(folder, name, log, log.motion_lines,
                         [&](ObjectFrame key, const SE3& e, std::optional<SE3> t) {
                           log.motions.emplace(key, LoggedMotion{e, std::move(t)});
                         });
    if (folder.has(poses)) {
      read_dynosam_objects(folder, poses, log, log.pose_lines,
                           [&](ObjectFrame key, const SE3& e, std::optional<SE3> t) {
                             if (t) log.true_poses.emplace(key, *t);
                             log.poses.emplace(key, e);
                           });
    }
    if (log.motions.empty())
      fail("{}: holds no motion: expected lines {}", (fs::path(folder.path()) / name).string(),
           dynosam_object);
    if (folder.has(cameras)) read_dynosam_cameras(folder, cameras, log);
    if (folder.has("frame_id_timestamp.csv")) read_dynosam_times(folder, "frame_id_timestamp.csv", log);
    logs.push_back(std::move(log));
  }
  if (logs.empty())
    fail("{}: holds no <module>_object_motion_log.csv: expected a folder of DynOSAM logs", folder.path());
  return logs;
}

std::map<ObjectFrame, SE3> read_vdo_motions(const LogFolder& folder, const std::string& name, ObjectLog& out,
                                            LogLines* lines = nullptr) {
  std::map<ObjectFrame, SE3> motions;
  FrameOrder order;
  for_each_record(folder, name, ' ', out, [&](const NumberFile& file, RepairLog& repairs) {
    expect(file, 18, "frame, label and 16 values of a 4x4 motion");
    const ObjectFrame key = {file.whole(1, "a label"), file.whole(0)};
    order.check(file, key, "label", lines);
    motions.emplace(key, matrix_pose(file, 2, repairs));
  });
  return motions;
}

void read_vdo_cameras(const LogFolder& folder, const std::string& name, Trajectory& camera, ObjectLog& out,
                      LogLines* lines = nullptr) {
  FrameOrder order;
  for_each_record(folder, name, ' ', out, [&](const NumberFile& file, RepairLog& repairs) {
    expect(file, 17, "a frame number and 16 values of a 4x4 pose");
    const int frame = file.whole(0);
    order.check(file, {0, frame}, "camera", lines);
    camera.set(frame, matrix_pose(file, 1, repairs));
  });
}

/// The files of one stage of VDO-SLAM; names are empty if the file does not exist.
struct VdoFiles {
  std::string motions, cameras;
};

/// Stores `name` in `file`, which must be empty.
void claim(const LogFolder& folder, const char* kind, const std::string& name, std::string& file) {
  if (!file.empty()) {
    fail("{}: holds several {}*.txt: keep one run per folder (there are {} and {})", folder.path(), kind,
         file, name);
  }
  file = name;
}

std::vector<ObjectLog> read_vdo(const LogFolder& folder, LogStage wanted) {
  VdoFiles initial, refined, truth;
  for (const std::string& name : folder.names()) {
    const auto holds = [&](const char* part) { return name.find(part) != std::string::npos; };
    const auto holds_after = [&](const char* part, const char* next) {
      return name.find(next, name.find(part)) != std::string::npos;
    };
    if (!name.ends_with(".txt")) continue;
    if (holds("obj_mot_gt"))
      claim(folder, "obj_mot_gt", name, truth.motions);
    else if (holds("obj_mot") && holds_after("obj_mot", "_rf"))
      claim(folder, "obj_mot_*_rf", name, refined.motions);
    else if (holds("obj_mot"))
      claim(folder, "obj_mot_", name, initial.motions);
    else if (holds("cam_pose_gt"))
      claim(folder, "cam_pose_gt", name, truth.cameras);
    else if (holds("refined_"))
      claim(folder, "refined_", name, refined.cameras);
    else if (holds("initial_"))
      claim(folder, "initial_", name, initial.cameras);
  }
  if (wanted == LogStage::any && !initial.motions.empty() && !refined.motions.empty()) {
    fail(
        "{}: holds motions of two stages, {} (initial) and {} (refined): "
        "choose one with --stage, or with objects.stage in a configuration",
        folder.path(), initial.motions, refined.motions);
  }
  const bool take_refined =
      wanted == LogStage::refined || (wanted == LogStage::any && initial.motions.empty());
  VdoFiles files = take_refined ? refined : initial;
  if (files.motions.empty()) {
    fail("{}: holds no {}: expected a folder of VDO-SLAM's results", folder.path(),
         wanted == LogStage::refined   ? "obj_mot_*_rf*.txt"
         : wanted == LogStage::initial ? "obj_mot_*.txt without _rf after obj_mot"
                                       : "obj_mot_*.txt besides the truth, obj_mot_gt*.txt");
  }
  // For a log with the motions of one stage only: the best cameras available.
  if (wanted == LogStage::any) files.cameras = !refined.cameras.empty() ? refined.cameras : initial.cameras;
  ObjectLog log{.estimator = "vdo", .frame = MotionFrame::body};
  for (const auto& [key, motion] : read_vdo_motions(folder, files.motions, log))
    log.motions[key].estimate = motion;
  if (log.motions.empty()) {
    fail("{}: holds no motion: expected lines of frame, label and 16 values of a 4x4 motion",
         (fs::path(folder.path()) / files.motions).string());
  }
  if (!truth.motions.empty()) {
    for (const auto& [key, motion] : read_vdo_motions(folder, truth.motions, log, &log.motion_lines)) {
      if (is_identity(motion)) {
        log.warnings.push_back(log.motion_lines.at(key) +
                               ": the truth is exactly the identity: treated as missing");
      } else {
        log.add_truth(key, motion);
      }
    }
  }
  if (!files.cameras.empty()) read_vdo_cameras(folder, files.cameras, log.camera, log);
  if (!truth.cameras.empty())
    read_vdo_cameras(folder, truth.cameras, log.true_camera, log, &log.camera_lines);
  return {log};
}

/// Warns of objects whose motions are exactly equal in all of at least three common frames: estimates of
/// different objects are never the same numbers.
void warn_of_copies(ObjectLog& log) {
  constexpr int fewest = 3;
  constexpr size_t most_named = 6;
  const auto numbers = [](const SE3& motion) {
    const Eigen::Matrix4d M = motion.matrix();
    return std::vector<double>(M.data(), M.data() + M.size());
  };
  std::map<std::pair<int, std::vector<double>>, int> last;  // of frame and motion: the last id
  std::map<std::pair<int, int>, int> equal;                 // of two ids: steps
  for (const auto& [key, motion] : log.motions) {
    if (is_identity(motion.estimate)) continue;
    const auto [at, is_new] = last.try_emplace({key.second, numbers(motion.estimate)}, key.first);
    if (!is_new) ++equal[{std::exchange(at->second, key.first), key.first}];
  }
  std::vector<std::string> pairs;
  for (const auto& [ids, n] : equal) {
    int common = 0;
    for (const auto& [key, motion] : entries_of(log.motions, ids.second))
      common += log.motions.contains({ids.first, key.second});
    if (n >= fewest && n == common) pairs.push_back(fmt::format("{} and {} ({})", ids.first, ids.second, n));
  }
  if (pairs.empty()) return;
  log.warnings.push_back(fmt::format(
      "{}: exactly the same motions have objects {}: an object that is logged twice counts twice in the "
      "errors of all objects; remove one (in brackets the number of common frames)",
      log.estimator, listed(pairs, most_named)));
}

}  // namespace

std::vector<ObjectLog> read_object_logs(const std::string& folder, const ObjectLogRequest& request) {
  if (request.format != LogFormat::vdo && request.stage != LogStage::any)
    fail("stage '{}': only results of format vdo have stages: leave --stage out", to_string(request.stage));
  const LogFolder files(folder, request);
  std::vector<ObjectLog> logs = request.format == LogFormat::dynosam ? read_dynosam(files)
                                : request.format == LogFormat::vdo   ? read_vdo(files, request.stage)
                                                                     : read_plain(files);
  if (request.frame) {
    if (request.format == LogFormat::poses)
      fail("--frame {}: poses are always in the world: leave --frame out for the format poses",
           to_string(*request.frame));
    for (ObjectLog& log : logs) log.frame = *request.frame;
  }
  for (ObjectLog& log : logs) warn_of_copies(log);
  return logs;
}

void ObjectLog::add_truth(ObjectFrame key, const SE3& motion) {
  const auto known = motions.find(key);
  if (known != motions.end()) {
    known->second.truth = motion;
  } else {
    lost_truth.emplace(key, motion);
  }
}

std::string LogLines::at(ObjectFrame key) const {
  const auto line = lines.find(key);
  const auto own = object_path.find(key.first);
  const std::string& file = own == object_path.end() ? path : own->second;
  return line == lines.end() ? file : fmt::format("{}:{}", file, line->second);
}

void camera_motions_to_world(ObjectLog& log, const Trajectory& truth) {
  if (log.frame != MotionFrame::camera) return;
  const Trajectory& own = log.camera.empty() ? truth : log.camera;
  const Trajectory& of_truth = !truth.empty() ? truth : log.true_camera.empty() ? own : log.true_camera;
  const auto in_world = [](const SE3& X, const Trajectory& camera, int frame) -> std::optional<SE3> {
    const auto before = camera.pose(frame - 1), after = camera.pose(frame);
    if (!before || !after) return std::nullopt;
    return world_motion(*before, *after, X);
  };
  std::map<ObjectFrame, LoggedMotion> motions;
  for (const auto& [key, motion] : log.motions) {
    const auto H = in_world(motion.estimate, own, key.second);
    if (!H) continue;
    motions[key] = {*H, motion.truth ? in_world(*motion.truth, of_truth, key.second) : std::nullopt};
  }
  if (motions.empty())
    fail(
        "--frame camera: no motion has the camera poses of both of its frames, which are needed to convert "
        "it to the world: give a log or --truth with them");
  std::map<ObjectFrame, SE3> lost;
  for (const auto& [key, X] : log.lost_truth) {
    if (const auto H = in_world(X, of_truth, key.second)) lost.emplace(key, *H);
  }
  log.motions = std::move(motions);
  log.lost_truth = std::move(lost);
  log.frame = MotionFrame::world;
  log.from_camera = true;
  if (log.motion_covariances.entries.empty()) return;
  log.motion_covariances = {};
  log.warnings.push_back(log.estimator +
                         ": covariances of motions in the camera frame are not used, so there is no NEES");
}

std::map<ObjectFrame, SE3> chained_poses(const ObjectLog& log) {
  std::map<ObjectFrame, SE3> poses;
  for (const auto& [key, motion] : log.motions) {  // an object's frames in order
    // The truth starts a path, unless a sequence of steps ends there.
    if (const auto truth = find_pose(log.true_poses, previous(key))) poses.emplace(previous(key), *truth);
    const auto before = find_pose(poses, previous(key));
    if (!before) continue;
    poses[key] = log.frame == MotionFrame::world ? motion.estimate * *before : *before * motion.estimate;
  }
  return poses;
}

bool holds_poses(const Trajectory& camera) {
  return std::ranges::any_of(camera.poses(), [](const auto& at) { return !is_identity(at.second); });
}

void move_to_world_of(const Trajectory& camera, ObjectLog& log) {
  for (const auto& [frame, pose] : (holds_poses(log.true_camera) ? log.true_camera : log.camera).poses()) {
    const auto here = camera.pose(frame);
    if (!here) continue;
    const SE3 T = *here * pose.inverse();
    Trajectory moved;
    for (const auto& [k, T_log_camera] : log.camera.poses()) moved.set(k, T * T_log_camera);
    log.camera = moved;
    for (auto& [key, T_log_object] : log.poses) T_log_object = T * T_log_object;
    PoseCovariance J = PoseCovariance::Zero();
    const Eigen::Matrix3d R = T.rotation().toRotationMatrix();
    J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = R;
    for (auto& [key, covariance] : log.pose_covariances.entries)
      covariance.P = J * covariance.P * J.transpose();
    if (log.frame != MotionFrame::world) return;
    for (auto& [key, motion] : log.motions) motion.estimate = T * motion.estimate * T.inverse();
    for (auto& [key, covariance] : log.motion_covariances.entries) {
      // t' = R t + T_t - R' T_t, so e_t' = R e_t + [R' T_t]x R e_R.
      const auto motion = log.motions.find(key);
      if (motion == log.motions.end()) continue;
      const Eigen::Vector3d lever = motion->second.estimate.rotation() * T.translation();
      J.topRightCorner<3, 3>() = skew(lever) * R;
      covariance.P = J * covariance.P * J.transpose();
    }
    return;
  }
}

}  // namespace sextant
