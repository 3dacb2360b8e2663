#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/logs/object_association.h"

namespace sextant {
namespace {

/// Positions of objects relative to their own cameras or, in frames in which a camera is unknown, in the
/// world.
struct ObjectPositions {
  std::map<ObjectFrame, Eigen::Vector3d> estimated, known;
};

ObjectPositions positions_of(const ObjectLog& log) {
  ObjectPositions out;
  const auto add = [&](const std::map<ObjectFrame, SE3>& poses, const Trajectory& camera, auto& positions) {
    for (const auto& [key, pose] : poses) {
      const bool relative = log.camera.pose(key.second) && log.true_camera.pose(key.second);
      const SE3 at = relative ? camera.pose(key.second)->inverse() * pose : pose;
      positions.emplace(key, at.translation());
    }
  };
  add(log.poses, log.camera, out.estimated);
  add(log.true_poses, log.true_camera, out.known);
  return out;
}

/// Frames in which an object follows the true object `other` instead of its own.
struct FollowedObject {
  int other = 0, from = 0, to = 0;
  size_t n = 0;
  double own_m = 0, other_m = 0;            ///< RMS distances
  bool from_start = false, to_end = false;  ///< of the frames that the three paths share
};

/// Returns the frames in which the object `id` follows the true object `other`: those with the largest number
/// of frames at most half as far from it as from the own object, minus that of the other frames between them.
std::optional<FollowedObject> followed(const ObjectPositions& at, int id, int other) {
  constexpr double near_m = 3;
  constexpr size_t fewest = 5;
  struct Distances {
    int frame;
    double own_m, other_m;
  };
  std::vector<Distances> steps;
  for (const auto& [key, place] : entries_of(at.estimated, id)) {
    const auto own = at.known.find(key), to = at.known.find({other, key.second});
    if (own == at.known.end() || to == at.known.end()) continue;
    steps.push_back({key.second, (place - own->second).norm(), (place - to->second).norm()});
  }
  int sum = 0, most = 0;
  size_t begin = 0, first = 0, last = 0;
  for (size_t i = 0; i < steps.size(); ++i) {
    if (sum <= 0) {
      sum = 0;
      begin = i;
    }
    sum += 2 * steps[i].other_m < steps[i].own_m ? 1 : -1;
    if (sum <= most) continue;
    most = sum;
    first = begin;
    last = i;
  }
  if (most < static_cast<int>(fewest)) return std::nullopt;
  FollowedObject found{other, steps[first].frame, steps[last].frame, last - first + 1};
  for (size_t i = first; i <= last; ++i) {
    found.own_m += steps[i].own_m * steps[i].own_m / static_cast<double>(found.n);
    found.other_m += steps[i].other_m * steps[i].other_m / static_cast<double>(found.n);
  }
  const bool explains = explains_times_of(found.n) * found.other_m <= found.own_m;
  found.own_m = std::sqrt(found.own_m);
  found.other_m = std::sqrt(found.other_m);
  found.from_start = first == 0;
  found.to_end = last + 1 == steps.size();
  return explains && found.other_m <= near_m ? std::optional(found) : std::nullopt;
}

}  // namespace

std::vector<DataWarning> diagnose_identities(const ObjectLog& log) {
  constexpr size_t most_named = 6;
  const ObjectPositions at = positions_of(log);
  std::vector<std::string> texts;
  std::set<int> first_frames;
  bool from_on = true;
  for (const int id : ids_of(log.poses)) {
    std::optional<FollowedObject> best;
    for (const int other : ids_of(log.true_poses)) {
      const auto found = other == id ? std::nullopt : followed(at, id, other);
      if (found && (!best || found->n > best->n)) best = found;
    }
    if (!best) continue;
    from_on = from_on && !best->from_start && best->to_end;
    first_frames.insert(best->from);
    texts.push_back(fmt::format(
        "what is scored as object {} follows true object {} in frames {}-{} (RMS distance {:.3g} m, from "
        "true object {} {:.3g} m)",
        object_text(id), best->other, best->from, best->to, best->other_m, object_text(id), best->own_m));
  }
  if (texts.empty()) return {};
  const std::string where =
      from_on && first_frames.size() == 1 ? fmt::format(" from frame {} on", *first_frames.begin()) : "";
  return {{"ids", fmt::format("{}, estimated poses of objects: the ids look exchanged{}: {}: write each "
                              "object under one id, that of the truth, in all of its frames",
                              log.estimator, where, listed(texts, most_named))}};
}

std::vector<DataWarning> diagnose_frames(const ObjectLog& log, const Trajectory& true_camera) {
  if (log.motions.empty()) return {};
  int first = std::numeric_limits<int>::max(), last = std::numeric_limits<int>::min();
  for (const auto& [key, motion] : log.motions) {
    first = std::min(first, key.second - 1);
    last = std::max(last, key.second);
  }
  for (const auto& [name, camera] :
       {std::pair("camera", &log.camera), std::pair("true camera", &true_camera)}) {
    const bool common = std::ranges::any_of(log.motions, [camera = camera](const auto& motion) {
      return camera->pose(motion.first.second) || camera->pose(motion.first.second - 1);
    });
    if (camera->empty() || common) continue;
    return {
        {"frames",
         fmt::format("{}: the objects have frames {}-{} and the {} has frames {}-{}, so they have no common "
                     "frame and no error in the frame of the camera: number the frames of both alike",
                     log.estimator, first, last, name, camera->poses().begin()->first,
                     camera->poses().rbegin()->first)}};
  }
  return {};
}

}  // namespace sextant
