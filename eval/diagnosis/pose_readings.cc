#include "sextant/eval/diagnosis/pose_readings.h"

#include <limits>

#include "sextant/eval/diagnosis/number_readings.h"

namespace sextant {
namespace {

using Poses = std::map<ObjectFrame, SE3>;

/// Applies `change`, SE3 and frame -> std::optional<SE3>, to every pose and drops the poses without a
/// result.
template <typename Change>
auto change_poses(Change change) {
  return [change](PoseData& data, double&) {
    Poses read;
    for (const auto& [key, pose] : data.given) {
      if (const std::optional<SE3> changed = change(data, pose, key)) read.emplace(key, *changed);
    }
    const bool most = 2 * read.size() >= data.given.size();
    data.given = std::move(read);
    return most;
  };
}

/// Calls use(g0, g1, r0, r1) for the steps that both sides have.
template <typename Use>
void for_each_step(const PoseData& data, const Use& use) {
  for (const auto& [key, g1] : data.given) {
    const ObjectFrame before = previous(key);
    const auto g0 = data.given.find(before), r0 = data.reference.find(before), r1 = data.reference.find(key);
    if (g0 != data.given.end() && r0 != data.reference.end() && r1 != data.reference.end())
      use(g0->second, g1, r0->second, r1->second);
  }
}

PoseData of_objects(const PoseData& data, const std::set<int>& ids) {
  PoseData some = data;
  std::erase_if(some.given, [&](const auto& at) { return !ids.contains(at.first.first); });
  return some;
}

/// Multiplies the positions by the factor s that minimises the sum of |s t_given - t_reference|^2 over the
/// steps of one body, in its axes before each step. A factor within 10 % of 1 is an error of the estimate.
bool fit_scale(PoseData& data, double& scale) {
  constexpr double least_change = 1.1;
  if (data.shared != SharedFrame::body) return false;
  double products = 0, squares = 0;
  for_each_step(data, [&](const SE3& g0, const SE3& g1, const SE3& r0, const SE3& r1) {
    const Eigen::Vector3d given = (g0.inverse() * g1).translation();
    products += given.dot((r0.inverse() * r1).translation());
    squares += given.squaredNorm();
  });
  if (!(products > 0)) return false;
  scale = products / squares;
  if (scale < least_change && scale > 1 / least_change) return false;
  for (auto& [key, pose] : data.given) pose = SE3(pose.rotation(), scale * pose.translation());
  return true;
}

/// Moves the pose of each frame k to frame n k. The frames in between get poses at constant velocity.
void spread_frames(PoseData& data, int n) {
  Poses spread;
  for (const auto& [key, pose] : data.given) {
    if (key.second >= std::numeric_limits<int>::max() / n - n) continue;
    const ObjectFrame place = {key.first, n * key.second};
    spread[place] = pose;
    const std::optional<SE3> next = find_pose(data.given, {key.first, key.second + 1});
    if (!next) continue;
    const Vector6d step = (pose.inverse() * *next).log() / n;
    for (int i = 1; i < n; ++i) spread[{place.first, place.second + i}] = pose * SE3::exp(i * step);
  }
  data.given = std::move(spread);
}

}  // namespace

std::optional<double> pose_residual(const PoseData& data) {
  std::vector<double> squares;
  for_each_step(data, [&](const SE3& g0, const SE3& g1, const SE3& r0, const SE3& r1) {
    const SE3 step =
        data.shared == SharedFrame::body ? g0.inverse() * g1 : r0.inverse() * (g1 * g0.inverse()) * r0;
    squares.push_back(squared_residual(step, r0.inverse() * r1));
  });
  return trimmed_mean(std::move(squares), fewest_steps);
}

std::optional<double> null_of_poses(const PoseData& data) {
  std::vector<double> squares;
  for_each_step(data, [&](const SE3&, const SE3&, const SE3& r0, const SE3& r1) {
    squares.push_back(squared_residual(SE3(), r0.inverse() * r1));
  });
  return trimmed_mean(std::move(squares), fewest_steps);
}

std::string RepeatedCameraPoses::text() const {
  return fmt::format(
      "repeats its pose exactly in {} of {} steps while the true camera moves, first at frame {}: a lost "
      "tracker? Leave lost poses out, then they count against coverage",
      frames.size(), n_steps, frames.front());
}

bool moves(const SE3& step) {
  constexpr double least_m = 0.01, least_rad = 0.001;
  return step.translation().norm() >= least_m || rotation_angle_rad(step.rotation()) >= least_rad;
}

bool is_identity(const SE3& motion) {
  constexpr double rounding = 1e-6;
  return motion.translation().norm() <= rounding && motion.rotation().vec().norm() <= rounding;
}

RepeatedCameraPoses repeated_camera_poses(const PoseData& data) {
  RepeatedCameraPoses out;
  for (const auto& [key, pose] : data.given) {
    const auto before = find_pose(data.given, previous(key));
    const auto r0 = find_pose(data.reference, previous(key)), r1 = find_pose(data.reference, key);
    if (key.first != 0 || !before || !r0 || !r1) continue;
    ++out.n_steps;
    if (pose.matrix() == before->matrix() && moves(r0->inverse() * *r1)) out.frames.push_back(key.second);
  }
  return out;
}

std::vector<Hypothesis<PoseData>> pose_hypotheses() {
  std::vector<Hypothesis<PoseData>> table;
  using Result = std::optional<SE3>;
  const auto add = [&](std::string code, std::string cause, std::string remedy, auto change,
                       double price = 0) {
    table.push_back({std::move(code), std::move(cause), std::move(remedy),
                     change_poses([change](const PoseData&, const SE3& pose, ObjectFrame) {
                       return Result(change(pose));
                     }),
                     price});
  };
  add("inverse", "the poses look inverted (world to body)", "invert each pose",
      [](const SE3& pose) { return pose.inverse(); });
  constexpr double price_of_scale = 0.6;
  table.push_back({"scale", "the positions look scaled: they agree when they are multiplied by {:.4g}",
                   "multiply them by this factor", fit_scale, price_of_scale, true});
  for (const auto& [code, cause, remedy, read, price] : number_readings("positions", 0))
    add(code, cause, remedy, read, price);
  table.push_back({"per_step", "the values look like motions from frame to frame, not poses",
                   "chain them to poses",
                   [](PoseData& data, double&) {
                     SE3 pose;
                     int object = 0;
                     for (auto& [key, step] : data.given) {
                       if (key.first != object) {
                         pose = find_pose(data.reference, previous(key)).value_or(SE3());
                       }
                       object = key.first;
                       step = pose = data.shared == SharedFrame::body ? pose * step : step * pose;
                     }
                     return true;
                   },
                   0.1});
  table.push_back(
      {"inverse_steps", "the motions of which the poses are chained look inverted, from frame k to k-1",
       "invert each motion",
       [](PoseData& data, double&) {
         const std::map<ObjectFrame, SE3> given = data.given;
         for (auto& [key, pose] : data.given) {
           const auto before = given.find(previous(key));
           if (before == given.end()) continue;
           const SE3 &g0 = before->second, &g1 = given.at(key), &read = data.given.at(previous(key));
           pose = data.shared == SharedFrame::body ? read * (g1.inverse() * g0) : g0 * g1.inverse() * read;
         }
         return true;
       },
       0.1});
  table.push_back({"frame_camera", "the poses look like those in the camera frame, not in the world",
                   "write T_world_camera times each pose",
                   [](PoseData& data, double& ignored) {
                     if (data.T_world_camera.empty()) return false;
                     return change_poses([](const PoseData& all, const SE3& pose, ObjectFrame key) -> Result {
                       const auto camera = all.T_world_camera.find(key.second);
                       if (camera == all.T_world_camera.end()) return std::nullopt;
                       return camera->second * pose;
                     })(data, ignored);
                   },
                   0.1});
  table.push_back(
      {"other_world",
       "the poses look like those in another world: the estimated camera starts elsewhere than the true one",
       "write them in the world of the truth: multiply them from the left by T_true "
       "inverse(T_estimated) of the camera in the first frame",
       [](PoseData& data, double&) {
         if (!data.T_true_estimated) return false;
         for (auto& [key, pose] : data.given) pose = *data.T_true_estimated * pose;
         return true;
       }});
  constexpr double price_of_spread = 0.5;
  for (const int n : {2, 3, 5, 10}) {
    table.push_back(
        {fmt::format("every_{}", n),
         fmt::format("the frames look numbered without gaps: the pose of frame {} k stands at frame k", n),
         fmt::format("multiply each frame number by {}", n),
         [n](PoseData& data, double&) {
           spread_frames(data, n);
           return true;
         },
         price_of_spread});
  }
  for (const int lag : frame_shifts) {
    table.push_back(
        shift_hypothesis<PoseData>(fmt::format("lag_{}", lag), "the pose of frame k", lag,
                                   change_poses([lag](const PoseData& all, const SE3&, ObjectFrame key) {
                                     return find_pose(all.given, {key.first, key.second + lag});
                                   })));
  }
  return table;
}

std::vector<ObjectExplanation> explain_poses(const PoseData& data) {
  const std::set<int> ids = ids_of(data.given);
  std::vector<Hypothesis<PoseData>> table = pose_hypotheses();
  if (!data.quaternions)
    std::erase_if(table, [](const auto& h) { return h.code.starts_with("quaternion_"); });
  std::vector<ObjectExplanation> out =
      explain_objects(ids, [&](const std::set<int>& of) -> std::optional<Explanation> {
        const PoseData some = of_objects(data, of);
        const std::optional<double> declared = pose_residual(some);
        if (!declared) return std::nullopt;
        return explain(*declared, read_as(table, some, pose_residual),
                       {.null = null_of_poses(some), .times = explains_times_of(some.given.size())});
      });
  if (out.empty()) {
    if (const auto shift = explain_hidden_shift(data))
      out.push_back({{ids.begin(), ids.end()}, true, *shift});
  }
  return out;
}

std::optional<Explanation> explain_hidden_shift(const PoseData& data) {
  const auto step_of = [&](const std::map<ObjectFrame, SE3>& poses, ObjectFrame key) -> std::optional<SE3> {
    if (data.shared == SharedFrame::world) return world_step(poses, key);
    const auto before = find_pose(poses, previous(key)), after = find_pose(poses, key);
    return before && after ? std::optional(before->inverse() * *after) : std::nullopt;
  };
  std::vector<StepError> steps;
  for (const auto& [key, pose] : data.given) {
    const auto given = step_of(data.given, key), expected = step_of(data.reference, key);
    if (!given || !expected) continue;
    // Steps in one world are compared at the place of the reference.
    const SE3 place = data.shared == SharedFrame::body ? SE3() : data.reference.at(previous(key));
    const auto difference = [&](const SE3& step) {
      return step_numbers(place.inverse() * expected->inverse() * step * place);
    };
    StepError step{key.first, key.second, difference(*given), {}};
    for (const int n : frame_shifts) {
      if (const auto other = step_of(data.reference, {key.first, key.second - n}))
        step.of_shift.emplace(n, difference(*other));
    }
    steps.push_back(std::move(step));
  }
  const std::optional<FrameShift> found = find_frame_shift(steps);
  if (!found) return std::nullopt;
  return explain_by_shift(*found, fmt::format("lag_{}", found->frames), pose_hypotheses(), data,
                          pose_residual);
}

}  // namespace sextant
