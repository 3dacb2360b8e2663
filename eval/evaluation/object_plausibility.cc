#include "sextant/eval/evaluation/object_plausibility.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

constexpr double fastest_mps = 100;
constexpr double largest_step_m = 50, step_rate_hz = 10;

/// Returns the speed of an object in a step, or a lower bound of it where its place is not known: the object
/// is then assumed to lie within 100 m of the camera, or of the origin.
double speed_of(const SE3& motion, MotionFrame frame, const std::optional<SE3>& T_world_object,
                const std::optional<SE3>& T_world_camera, double rate_hz) {
  if (frame == MotionFrame::body) return motion.translation().norm() * rate_hz;
  if (T_world_object) return body_motion(motion, *T_world_object).translation().norm() * rate_hz;
  constexpr double reach_m = 100;
  const Eigen::Vector3d c = T_world_camera ? T_world_camera->translation() : Eigen::Vector3d::Zero();
  const double by_rotation_m = 2 * std::sin(rotation_angle_rad(motion.rotation()) / 2) * reach_m;
  return std::max(0.0, (motion * c - c).norm() - by_rotation_m) * rate_hz;
}

/// Asks for the unit of a value that is `times` the largest expected one.
std::string ask_for_unit(double times) {
  return fmt::format(": are the translations {}millimetres (divide them by 1000), or is --rate wrong?",
                     times < 100 ? "centimetres (divide them by 100) or " : "");
}

}  // namespace

std::map<ObjectFrame, SE3> true_motions(const ObjectLog& log) {
  std::map<ObjectFrame, SE3> motions = log.lost_truth;
  for (const auto& [key, motion] : log.motions) {
    if (motion.truth) motions.emplace(key, *motion.truth);
  }
  return motions;
}

std::map<ObjectFrame, SE3> camera_poses(const Trajectory& camera) {
  std::map<ObjectFrame, SE3> poses;
  for (const auto& [frame, pose] : camera.poses()) poses.emplace(ObjectFrame(0, frame), pose);
  return poses;
}

void check_plausible(const ObjectLog& log, double rate_hz, const std::vector<LogDiagnosis>& found) {
  // `times` is the ratio of the value to the largest expected value.
  const auto because = [&](double times) {
    std::string text;
    for (const LogDiagnosis& diagnosis : found) text += "; " + diagnosis.text;
    return text.empty() ? ask_for_unit(times) : text;
  };
  for (const auto& [key, motion] : true_motions(log)) {
    const double speed_mps = speed_of(motion, log.frame, find_pose(log.true_poses, previous(key)),
                                      log.true_camera.pose(key.second - 1), rate_hz);
    if (speed_mps > fastest_mps) {
      fail(
          "{}: the true speed of object {} at frame {} is {:.4g} m/s at {:.4g} Hz, expected at most {} m/s{}",
          log.motion_lines.at(key), key.first, key.second, speed_mps, rate_hz, fastest_mps,
          because(speed_mps / fastest_mps));
    }
  }
  const double most_m = largest_step_m * step_rate_hz / rate_hz;
  const auto check_steps = [&](const std::map<ObjectFrame, SE3>& poses, const LogLines& lines,
                               const char* what) {
    for (const auto& [key, pose] : poses) {
      const auto last = find_pose(poses, previous(key));
      if (!last) continue;
      const double step_m = (pose.translation() - last->translation()).norm();
      if (step_m > most_m) {
        fail("{}: the true {} moves {:.4g} m from frame {} to {}, expected at most {:.4g} m at {:.4g} Hz{}",
             lines.at(key), what, step_m, key.second - 1, key.second, most_m, rate_hz,
             because(step_m / most_m));
      }
    }
  };
  check_steps(log.true_poses, log.pose_lines, "object");
  check_steps(camera_poses(log.true_camera), log.camera_lines, "camera");
}

std::vector<LogDiagnosis> diagnose_speeds(const ObjectLog& log, double rate_hz) {
  std::map<int, std::vector<double>> speeds;
  for (const auto& [key, motion] : log.motions) {
    auto L = find_pose(log.true_poses, previous(key));
    if (!L) L = find_pose(log.poses, previous(key));
    speeds[key.first].push_back(
        speed_of(motion.estimate, log.frame, L, log.camera.pose(key.second - 1), rate_hz));
  }
  std::vector<LogDiagnosis> out;
  for (auto& [id, of_object] : speeds) {
    const auto middle = of_object.begin() + static_cast<std::ptrdiff_t>(of_object.size() / 2);
    std::ranges::nth_element(of_object, middle);
    if (*middle <= fastest_mps) continue;
    out.push_back(
        {"speed",
         fmt::format("{}, estimated motions of object {}: median speed {:.4g} m/s at {:.4g} Hz, expected "
                     "at most {} m/s{}",
                     log.estimator, id, *middle, rate_hz, fastest_mps, ask_for_unit(*middle / fastest_mps))});
  }
  return out;
}

std::map<int, std::vector<int>> identity_steps(const ObjectLog& log) {
  constexpr double moves_m = 0.01;
  // Rows that were converted from another frame, or rounded, are the identity up to their last digits.
  constexpr double rounding = 1e-6;
  const auto is_identity = [](const SE3& T) {
    return T.translation().norm() <= rounding && T.rotation().vec().norm() <= rounding;
  };
  const auto step_m = [&](ObjectFrame key, const SE3& motion) {
    const auto L = find_pose(log.true_poses.empty() ? log.poses : log.true_poses, previous(key));
    return log.frame == MotionFrame::world && L ? body_motion(motion, *L).translation().norm()
                                                : motion.translation().norm();
  };
  std::map<int, int> moving, all;
  for (const auto& [key, motion] : log.motions) {
    ++all[key.first];
    moving[key.first] += !is_identity(motion.estimate) && step_m(key, motion.estimate) > moves_m;
  }
  std::map<int, std::vector<int>> out;
  for (const auto& [key, motion] : log.motions) {
    if (!is_identity(motion.estimate)) continue;
    // Without a known truth, an object counts as moving if it moves in most of its other steps.
    const bool moves =
        motion.truth ? step_m(key, *motion.truth) > moves_m : 2 * moving[key.first] > all[key.first] / 2;
    if (moves) out[key.first].push_back(key.second);
  }
  return out;
}

std::map<int, std::vector<int>> missing_steps(const ObjectLog& log) {
  std::map<int, std::set<int>> known;  // steps with an estimate or truth
  for (const auto& [key, motion] : log.motions) known[key.first].insert(key.second);
  for (const auto& [key, motion] : log.lost_truth) known[key.first].insert(key.second);
  for (const auto& [key, pose] : log.true_poses) {
    if (log.true_poses.contains(previous(key)) && !log.resting.contains(key))
      known[key.first].insert(key.second);
  }
  std::map<int, std::vector<int>> out;
  for (const auto& [id, steps] : known) {
    for (int k = *steps.begin(); k <= *steps.rbegin(); ++k) {
      // Frames that the data set's truth lacks do not belong to the object.
      const bool counts = !log.truth_of_source || steps.contains(k);
      if (counts && !log.motions.contains({id, k})) out[id].push_back(k);
    }
  }
  return out;
}

std::string ranges_text(const std::vector<int>& frames, size_t most) {
  std::vector<std::string> groups;
  for (size_t i = 0; i < frames.size();) {
    size_t j = i;
    while (j + 1 < frames.size() && frames[j + 1] == frames[j] + 1) ++j;
    groups.push_back(i == j ? std::to_string(frames[i]) : fmt::format("{}-{}", frames[i], frames[j]));
    i = j + 1;
  }
  if (groups.size() <= most) return fmt::format("{}", fmt::join(groups, ", "));
  const size_t more = groups.size() - most;
  groups.resize(most);
  return fmt::format("{} and {} more", fmt::join(groups, ", "), more);
}

}  // namespace sextant
