#include "sextant/eval/logs/object_association.h"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {
namespace {

/// Returns the distance of a logged object from a true one in frame k, m: between the positions relative to
/// their own cameras if both cameras are known, otherwise in the world.
double distance_m(const ObjectLog& log, ObjectFrame logged, const Trajectory& camera, const SE3& true_pose) {
  const auto own = log.camera.pose(logged.second), other = camera.pose(logged.second);
  const SE3& pose = log.poses.at(logged);
  if (!own || !other) return (pose.translation() - true_pose.translation()).norm();
  return ((own->inverse() * pose).translation() - (other->inverse() * true_pose).translation()).norm();
}

/// Returns the agreement of a logged step with the step of a true object, from 0 to 1 (equal): of the
/// positions if the log has the pose, otherwise of the motions. Empty if the true object has no such step.
std::optional<double> agreement(const ObjectLog& log, ObjectFrame logged,
                                const std::map<ObjectFrame, SE3>& poses, const Trajectory& camera,
                                ObjectFrame key) {
  constexpr double near_m = 3, agrees_m = 0.5;
  const auto H = world_step(poses, key);
  if (!H) return std::nullopt;
  if (log.poses.contains(logged))
    return std::max(0.0, 1 - distance_m(log, logged, camera, poses.at(key)) / near_m);
  const SE3& L = poses.at(previous(key));
  const SE3& motion = log.motions.at(logged).estimate;
  const SE3 body = log.frame == MotionFrame::world ? body_motion(motion, L) : motion;
  return std::max(0.0, 1 - pose_change_error(body, body_motion(*H, L)).Et_m / agrees_m);
}

struct Association {
  std::map<int, int> true_ids;  ///< of logged ids, see take_truth()
  /// Logged ids without a partner whose best true object has gone to another logged object: its true id.
  std::map<int, int> taken;
  std::map<std::pair<int, int>, std::set<int>> near;  ///< frames that agree, of a logged id and a true id
};

Association associate(const ObjectLog& log, const std::map<ObjectFrame, SE3>& poses,
                      const Trajectory& camera) {
  std::map<int, int> n_steps;
  for (const auto& [key, motion] : log.motions) ++n_steps[key.first];
  int fewest = 0;  // 3, or all steps of the longest object of a shorter log
  for (const auto& [id, n] : n_steps) fewest = std::clamp(n, fewest, 3);
  const std::set<int> true_ids = ids_of(poses);
  struct Shared {
    int agree = 0, far = 0;  ///< steps; far: positions that do not agree
    double agreement = 0;
  };
  std::map<std::pair<int, int>, Shared> shared;  // of logged id and true id
  Association out;
  for (const auto& [key, motion] : log.motions) {
    for (const int id : true_ids) {
      const auto agrees = agreement(log, key, poses, camera, {id, key.second});
      if (!agrees) continue;
      Shared& both = shared[{key.first, id}];
      both.agree += *agrees > 0;
      if (*agrees > 0) out.near[{key.first, id}].insert(key.second);
      both.far += *agrees == 0 && log.poses.contains(key);
      both.agreement += *agrees;
    }
  }
  // ordered by agreement, then equal ids, then small ids
  std::vector<std::tuple<double, bool, int, int>> best;
  for (const auto& [ids, both] : shared) {
    if (both.agree >= fewest && both.agree > both.far)
      best.emplace_back(-both.agreement, ids.first != ids.second, ids.first, ids.second);
  }
  std::sort(best.begin(), best.end());
  constexpr double least_share = 0.5;  // of the agreement with the true object that agrees best
  std::set<int> assigned;
  std::map<int, double> largest;  // agreement of each logged id
  for (const auto& [n, differs, logged, id] : best) {
    largest.try_emplace(logged, -n);
    if (out.true_ids.contains(logged) || -n < least_share * largest.at(logged)) continue;
    if (assigned.insert(id).second) {
      out.true_ids[logged] = id;
      out.taken.erase(logged);
    } else {
      out.taken.try_emplace(logged, id);
    }
  }
  return out;
}

/// Explains that the logged object `id` has no truth, because another one is assigned to its true object.
std::string text_of_second(const Association& found, int id, int first, int true_id) {
  const std::set<int>& own = found.near.at({id, true_id});
  const std::set<int>& other = found.near.at({first, true_id});
  const auto common = std::ranges::count_if(own, [&](int frame) { return other.contains(frame); });
  const std::string follows = fmt::format("logged object {} follows true object {} in frames {}-{}", id,
                                          true_id, *own.begin(), *own.rbegin());
  if (2 * static_cast<size_t>(common) > own.size())
    return fmt::format(
        "{}, and logged object {} does so in {} of these frames: an object that is logged "
        "twice is scored once, and object {} has no truth",
        follows, first, common, id);
  return fmt::format(
      "{}, and logged object {} does so in other frames: the log changes the id of this "
      "object, so the steps of object {} have no truth and count as lost",
      follows, first, id);
}

/// Returns true if the object is known in the frame before, and moves from there to this frame unless it is
/// declared static: the flag of a frame describes the step to the next one.
bool moves_to(const SequenceTruth& truth, int frame, int id) {
  const ObjectTruth* before = truth.find(frame - 1, id);
  return before != nullptr && before->moving.value_or(true);
}

}  // namespace

std::map<ObjectFrame, SE3> true_object_poses(const SequenceTruth& truth) {
  std::map<ObjectFrame, SE3> poses;
  for (const auto& [frame, objects] : truth.objects) {
    const std::optional<SE3> camera = truth.camera.pose(frame);
    for (const ObjectTruth& object : objects) {
      // The last step of an object that halts ends at a frame with the flag false.
      if (camera && (object.moving.value_or(true) || moves_to(truth, frame, object.id)))
        poses[{object.id, frame}] = *camera * object.T_camera_object;
    }
  }
  return poses;
}

std::string object_text(int id) {
  return id < unmatched_object ? std::to_string(id) : fmt::format("{} of the log", id - unmatched_object);
}

void take_truth(ObjectLog& log, const SequenceTruth& truth) {
  std::map<ObjectFrame, SE3> poses = true_object_poses(truth);
  move_to_world_of(truth.camera, log);
  const Association found = associate(log, poses, truth.camera);
  const std::map<int, int>& ids = found.true_ids;
  log.resting.clear();
  for (const auto& [key, pose] : poses) {
    if (poses.contains(previous(key)) && !moves_to(truth, key.second, key.first)) log.resting.insert(key);
  }
  std::map<int, int> renamed;
  const auto new_id = [&](int id) {
    const auto known = ids.find(id);
    if (known != ids.end()) return known->second;
    return renamed.try_emplace(id, unmatched_object + id).first->second;
  };
  std::map<int, std::string> seconds;  // texts of logged ids
  for (const auto& [logged, id] : found.taken) {
    for (const auto& [first, assigned] : ids) {
      if (assigned == id) seconds[logged] = text_of_second(found, logged, first, id);
    }
  }
  std::map<ObjectFrame, LoggedMotion> motions;
  for (const auto& [key, motion] : log.motions) {
    const ObjectFrame own = {new_id(key.first), key.second};
    LoggedMotion& m = motions[own];
    m.estimate = motion.estimate;
    const auto H = world_step(poses, own);
    if (!H || log.resting.contains(own)) continue;
    m.truth = log.frame == MotionFrame::world ? *H : body_motion(*H, poses.at(previous(own)));
  }
  std::map<ObjectFrame, SE3> estimated;
  for (const auto& [key, pose] : log.poses) estimated[{new_id(key.first), key.second}] = pose;
  for (LogCovariances* covariances : {&log.motion_covariances, &log.pose_covariances}) {
    LogCovariances own;
    for (const auto& [key, entry] : covariances->entries)
      own.entries.emplace(ObjectFrame(new_id(key.first), key.second), entry);
    for (const auto& [id, path] : covariances->paths) own.paths[new_id(id)] = path;
    *covariances = std::move(own);
  }
  log.motions = std::move(motions);
  log.poses = std::move(estimated);
  log.true_poses = std::move(poses);
  log.true_camera = truth.camera;
  log.lost_truth.clear();
  log.truth_of_source = true;
  for (const auto& [logged, id] : ids) {
    if (logged != id)
      log.warnings.push_back(fmt::format("logged object {} is true object {}, by overlap", logged, id));
  }
  for (const auto& [logged, id] : renamed) {
    const auto second = seconds.find(logged);
    log.warnings.push_back(
        second != seconds.end()
            ? second->second
            : fmt::format("logged object {} agrees with no true object that moves, so it has no truth",
                          logged));
  }
}

}  // namespace sextant
