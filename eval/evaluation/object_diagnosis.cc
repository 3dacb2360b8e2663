#include "sextant/eval/evaluation/object_evaluation.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/motion_disagreement.h"
#include "sextant/eval/diagnosis/pose_readings.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/logs/object_association.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

using Motions = std::map<ObjectFrame, SE3>;

/// Estimated motions, without those that a lost object has as the identity: they are reported by themselves.
Motions estimates(const ObjectLog& log) {
  const std::map<int, std::vector<int>> lost = identity_steps(log);
  Motions motions;
  for (const auto& [key, motion] : log.motions) {
    const auto frames = lost.find(key.first);
    if (frames == lost.end() || !std::ranges::binary_search(frames->second, key.second))
      motions.emplace(key, motion.estimate);
  }
  return motions;
}

/// Returns the function (key, sample) that computes the motion of a step of a path in the frame `to`.
auto steps_between(const Motions& path, MotionFrame to) {
  return [&path, to](ObjectFrame key, const MotionSample& at) -> std::optional<SE3> {
    const auto H = world_step(path, key);
    return H ? change_frame(*H, MotionFrame::world, to, at) : std::nullopt;
  };
}

/// Collects motions `given` with the `reference`, a function (key, sample) -> std::optional<SE3>, at the
/// poses L of the objects.
template <typename Reference>
MotionData motion_data(const Motions& given, MotionFrame declared, const Motions& L, const Trajectory& camera,
                       const Reference& reference) {
  MotionData data{declared, {}, given};
  for (const auto& [key, motion] : given) {
    MotionSample sample{
        key, motion, {}, find_pose(L, previous(key)), camera.pose(key.second - 1), camera.pose(key.second)};
    const std::optional<SE3> expected = reference(key, sample);
    if (!expected) continue;
    sample.reference = *expected;
    data.samples.push_back(std::move(sample));
  }
  return data;
}

/// Rewrites readings of the estimates in another frame than that of the log's own true motions. They have no
/// remedy by --frame, which applies to the estimated and to the true motions.
void name_frames_of_both(const ObjectLog& log, Reading& reading) {
  const std::string flag = "give --frame ", code = "frame_";
  const size_t at = reading.remedy.find(flag);
  if (at == std::string::npos) return;
  const std::string other = reading.remedy.substr(at + flag.size());
  const bool is_world = log.frame == MotionFrame::world && !log.from_camera;
  // Without a default frame either of the two may be the one in another frame.
  if (!is_world && reading.code.starts_with(code)) {
    reading.cause =
        log.from_camera
            ? "the estimated and the true motions look like those in two frames, the world and the camera"
            : fmt::format("the estimated and the true motions look like those in two frames, {} and {}",
                          other, to_string(log.frame));
  }
  reading.remedy =
      reading.remedy.substr(0, at) +
      (is_world          ? "convert the estimates to the world frame, because the true motions are in it "
                           "and --frame would apply to both"
       : log.from_camera ? "leave --frame out and write both in the world frame, because --frame camera "
                           "applies to both"
                         : "convert the estimates to the frame of the true motions, because --frame applies "
                           "to both");
}

std::vector<DataWarning> diagnoses_of(const std::vector<ObjectExplanation>& found,
                                      const std::string& subject) {
  std::vector<DataWarning> out;
  for (const ObjectExplanation& explanation : found)
    out.push_back({explanation.code(), explanation.text(subject)});
  return out;
}

bool any_allows(const std::vector<ObjectExplanation>& found, const std::string& code) {
  return std::ranges::any_of(found, [&](const ObjectExplanation& e) { return e.explanation.allows(code); });
}

/// Examines an estimated and a true path alone: paths that are wrong in the same way agree with each other.
/// `subject` names what moves, "camera" or "object". With `only_both`, an estimate is not reported unless its
/// truth is wrong in the same way.
std::optional<DataWarning> diagnose_alone(const PoseSeries& given, const PoseSeries& truth, bool only_both,
                                          const std::string& name, const std::string& subject) {
  const auto of_truth = explain_alone(truth);
  if (only_both && !of_truth) return std::nullopt;
  const auto own = explain_alone(given);
  if (!own) return std::nullopt;
  const std::string& code = own->best.code;
  const bool both = of_truth && of_truth->best.code == code;
  // Without a true path, or with one that says nothing by itself, the estimate alone is reported.
  if (of_truth && !both) return std::nullopt;
  const std::string cause = code == "inverse" ? "the poses look inverted (world to body)"
                            : code == "transposed"
                                ? "the rotations look transposed"
                                : "the quaternions look written with w at the other end of x y z";
  const std::string remedy = code == "inverse"      ? "invert each pose"
                             : code == "transposed" ? "transpose each rotation"
                                                    : "reorder the columns";
  return DataWarning{
      code, fmt::format("{}: {}: the {} moves along one direction of its own axes within {:.1f} deg when "
                        "read so, {:.1f} deg as declared: {}{}",
                        name, cause, subject, std::sqrt(own->best.residual), std::sqrt(own->declared), remedy,
                        both ? " of both" : "")};
}

/// True if the first pose is turned by 180 deg about x, as the identity written w first reads.
bool begins_upside_down(const Trajectory& camera) {
  constexpr double near_one = 0.99;
  return !camera.empty() && std::abs(camera.poses().begin()->second.rotation().x()) > near_one;
}

std::vector<DataWarning> diagnose_camera(const Trajectory& camera, const Trajectory& truth,
                                         const std::string& subject) {
  if (!holds_poses(truth)) return {};
  const PoseData data{SharedFrame::body, camera_poses(camera), camera_poses(truth), {}};
  const std::vector<ObjectExplanation> explained = explain_poses(data);
  if (!explained.empty()) return diagnoses_of(explained, subject);
  if (const RepeatedCameraPoses repeated = repeated_camera_poses(data); repeated.frames.size() >= 2)
    return {{"repeated_poses", fmt::format("{} {}", subject, repeated.text())}};
  const std::string both = subject + " and true camera";
  if (begins_upside_down(camera) && begins_upside_down(truth)) {
    return {{"quaternion_w_first",
             both + ": the first pose is turned by 180 deg about x, as the identity is if its "
                    "quaternion is written w first (w x y z) and read as x y z w: reorder the columns "
                    "to qx,qy,qz,qw unless the camera hangs upside down"}};
  }
  if (const auto found = diagnose_alone(object_series(data.given, 0), object_series(data.reference, 0),
                                        /*only_both=*/true, both, "camera"))
    return {*found};
  Motions steps;
  for (const auto& [frame, pose] : truth.poses()) {
    if (const auto last = truth.pose(frame - 1)) steps.emplace(ObjectFrame(0, frame), last->inverse() * pose);
  }
  if (bodies_that_reverse(steps, {Eigen::Vector3d::UnitZ()}).empty()) return {};
  return {{"backwards",
           both + ": the camera moves backwards (along its -z axis) throughout the log: unless it looks "
                  "backwards, the poses are inverted (world to body): invert each pose of both"}};
}

/// Compares the estimated motions with those between the estimated poses of the same log.
std::vector<ObjectExplanation> explain_by_own_poses(const ObjectLog& log, const Motions& given) {
  return explain_motions(
      motion_data(given, log.frame, log.poses, log.camera, steps_between(log.poses, log.frame)));
}

constexpr const char* against_own_poses = ", estimated motions against the estimated poses";

/// Compares the poses of `path` with the paths that the motions lead to from the first pose of each stretch.
std::vector<ObjectExplanation> explain_by_motions(const Motions& path, const Motions& motions,
                                                  const ObjectLog& log, const Trajectory& camera) {
  if (log.frame != MotionFrame::world) return {};
  PoseData data{SharedFrame::world, path, {}, camera.poses()};
  for (const auto& [key, H] : motions) {
    const auto own = find_pose(path, previous(key));
    if (own) data.reference.try_emplace(previous(key), *own);
    const auto start = find_pose(data.reference, previous(key));
    if (start) data.reference[key] = H * *start;
  }
  return explain_poses(data);
}

/// Estimated motions with their truth.
MotionData matched_motions(const ObjectLog& log) {
  const Trajectory& camera = holds_poses(log.true_camera) ? log.true_camera : log.camera;
  const auto truth = [&](ObjectFrame key, const MotionSample& at) {
    const std::optional<SE3>& logged = log.motions.at(key).truth;
    if (logged || log.resting.contains(key)) return logged;
    return steps_between(log.true_poses, log.frame)(key, at);
  };
  return motion_data(estimates(log), log.frame, log.true_poses, camera, truth);
}

/// Reports poses of objects whose axes are turned by one rotation against the true ones.
std::optional<DataWarning> diagnose_object_axes(const ObjectLog& log) {
  constexpr double least_rad = 20 * degree, scatter_rad = 10 * degree;
  std::vector<Eigen::Matrix3d> turns;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const auto& [key, pose] : log.poses) {
    const auto truth = find_pose(log.true_poses, key);
    if (!truth) continue;
    turns.push_back((pose.rotation().conjugate() * truth->rotation()).toRotationMatrix());
    sum += turns.back();
  }
  if (turns.size() < fewest_vectors) return std::nullopt;
  const Eigen::Matrix3d B = nearest_rotation(sum);
  double squares = 0;
  for (const Eigen::Matrix3d& turn : turns)
    squares += std::pow(rotation_angle_rad(B.transpose() * turn), 2) / static_cast<double>(turns.size());
  if (rotation_angle_rad(B) < least_rad || std::sqrt(squares) > scatter_rad) return std::nullopt;
  const Eigen::AngleAxisd turn(B);
  const Eigen::Vector3d axis = turn.axis();
  return DataWarning{
      "object_axes",
      fmt::format(
          "{}, estimated poses of objects: their axes are turned by {:.0f} deg against the true ones, "
          "the same within {:.1f} deg: errors of the poses (APE, RPE, errors per axis) depend on the "
          "axes. Turn each pose from the right by {:.4g} deg about its own axis [{:.3f} {:.3f} {:.3f}]",
          log.estimator, turn.angle() / degree, std::sqrt(squares) / degree, turn.angle() / degree, axis.x(),
          axis.y(), axis.z())};
}

/// Reports rotations that no object performs between successive frames.
std::vector<DataWarning> diagnose_rotations(const Motions& motions, const std::string& subject) {
  const auto found = explain_rotations(motions);
  if (!found) return {};
  return {{found->best.code, message(*found, subject, "m")}};
}

/// Reports a log of translations: none of its motions turns, although the true ones do.
std::vector<DataWarning> diagnose_missing_rotations(const Motions& given, const Motions& truth,
                                                    const std::string& subject) {
  constexpr double rounding_rad = 1e-9, least_deg = 0.5;
  const auto largest_rad = [](const Motions& motions) {
    double largest = 0;
    for (const auto& [key, motion] : motions)
      largest = std::max(largest, rotation_angle_rad(motion.rotation()));
    return largest;
  };
  const double true_deg = degrees(largest_rad(truth));
  if (given.size() < fewest_steps || largest_rad(given) > rounding_rad || true_deg < least_deg) return {};
  return {
      {"no_rotations",
       fmt::format("{}: none of the {} motions turns, but the true ones turn by up to {:.1f} deg a frame: "
                   "does the log have translations only? Then E_R, and in the world frame E_t and E_v too, "
                   "mean nothing: log the rotations as well",
                   subject, given.size(), true_deg)}};
}

/// Reports motions in the objects' own frames along which they drive backwards. If truth and estimate are
/// both inverse, they agree with each other, so only the direction shows it.
std::vector<DataWarning> diagnose_direction(const ObjectLog& log, const Motions& motions) {
  if (log.frame != MotionFrame::body) return {};
  const std::vector<int> backwards =
      bodies_that_reverse(motions, {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()});
  if (backwards.empty()) return {};
  return {
      {"backwards",
       fmt::format(
           "{}, motions of object{} {}: backwards (along -x or -z of their own axes) throughout the log: if "
           "x or z points forward, the motions are inverted, from frame k to k-1: invert each motion; a "
           "comparison with --truth decides",
           log.estimator, backwards.size() > 1 ? "s" : "", fmt::join(backwards, ", "))}};
}

/// Examines the path of each object alone.
std::vector<DataWarning> diagnose_paths(const ObjectLog& log) {
  std::vector<DataWarning> out;
  for (const int id : ids_of(log.poses)) {
    auto found =
        diagnose_alone(object_series(log.poses, id), object_series(log.true_poses, id), /*only_both=*/false,
                       fmt::format("{}, poses of object {}", log.estimator, id), "object");
    if (found) out.push_back(std::move(*found));
  }
  return out;
}

// ---- Comparison with the truth of a data set.

/// Transforms the log so that both camera paths agree at the first frame that they share.
ObjectLog moved(ObjectLog log, const SequenceTruth& truth) {
  move_to_world_of(truth.camera, log);
  return log;
}

size_t n_steps(const MotionData& data) { return data.samples.size(); }
size_t n_steps(const PoseData& data) { return data.given.size(); }

/// Poses are not compared with an object that stands still.
std::optional<double> no_residual(const PoseData&) { return std::nullopt; }

/// Explains each object of the log by comparing every reading with the true object that it fits best.
template <typename Data, typename DataOf, typename Residual, typename NullOf, typename StillOf>
std::map<int, Explanation> explain_by_best_match(const std::set<int>& ids, const std::set<int>& true_ids,
                                                 const std::vector<Hypothesis<Data>>& table,
                                                 const DataOf& data_of, const Residual& residual,
                                                 const NullOf& null_of, const StillOf& still_of) {
  std::map<int, Explanation> out;
  for (const int id : ids) {
    std::optional<double> declared, declared_own;
    std::map<std::string, Reading> best, own_best;
    double times = explains_times;
    for (const int true_id : true_ids) {
      const Data data = data_of(id, true_id);
      const std::optional<double> own = residual(data), null = null_of(data);
      if (!own || !null) continue;
      declared = declared ? std::min(*declared, *own) : *own;
      if (id == true_id) declared_own = own;
      const std::optional<double> still = still_of(data);
      for (Reading& reading : read_as(table, data, residual)) {
        times = explains_times_of(n_steps(data));
        if (times * reading.residual > *null || !is_plausible(reading, still, times)) continue;
        if (id == true_id) own_best[reading.code] = reading;
        const auto known = best.find(reading.code);
        if (known == best.end() || reading.residual < known->second.residual)
          best[reading.code] = std::move(reading);
      }
    }
    if (!declared) continue;
    const auto in_order_of_table = [&](const std::map<std::string, Reading>& found) {
      std::vector<Reading> readings;
      for (const Hypothesis<Data>& hypothesis : table) {
        const auto known = found.find(hypothesis.code);
        if (known != found.end()) readings.push_back(known->second);
      }
      return readings;
    };
    if (const auto found = explain(*declared, in_order_of_table(best), {.times = times})) {
      out.emplace(id, *found);
    } else if (declared_own) {
      // If the log may use the ids of the truth: readings that fit the object with the same id, provided they
      // fit it better than the declared reading fits any other object.
      std::erase_if(own_best, [&](const auto& at) { return !(2 * at.second.residual <= *declared); });
      const auto own = explain(*declared_own, in_order_of_table(own_best), {.times = times});
      if (own) out.emplace(id, *own);
    }
  }
  return out;
}

Motions of_object(const Motions& motions, int id, int as) {
  Motions one;
  for (const auto& [key, motion] : entries_of(motions, id)) one.emplace(ObjectFrame(as, key.second), motion);
  return one;
}

}  // namespace

/// Returns W with W T_estimated = T_true in the first frame that both cameras have; empty if W moves no point
/// within 100 m by 1 cm.
std::optional<SE3> true_from_estimated_world(const Trajectory& estimated, const Trajectory& truth) {
  constexpr double same_m = 0.01, distance_m = 100;
  if (!holds_poses(truth)) return std::nullopt;
  for (const auto& [frame, pose] : estimated.poses()) {
    const auto expected = truth.pose(frame);
    if (!expected) continue;
    const SE3 W = *expected * pose.inverse();
    if (W.translation().norm() + distance_m * rotation_angle_rad(W.rotation()) < same_m) return std::nullopt;
    return W;
  }
  return std::nullopt;
}

std::vector<DataWarning> diagnose_log(const ObjectLog& log) {
  const std::string& name = log.estimator;
  const Motions given = estimates(log), truth = true_motions(log);
  std::vector<DataWarning> out = diagnose_rotations(truth, name + ", true motions");
  append(out, diagnose_rotations(given, name + ", estimated motions"));
  if (!out.empty()) return out;  // with such rotations nothing else can be judged

  const std::optional<SE3> W = true_from_estimated_world(log.camera, log.true_camera);
  const std::vector<ObjectExplanation> of_poses =
      explain_poses({SharedFrame::world, log.poses, log.true_poses, log.camera.poses(), W});
  append(out, diagnoses_of(of_poses, name + ", estimated poses of objects"));
  const std::vector<DataWarning> of_camera =
      diagnose_camera(log.camera, log.true_camera, name + ", estimated camera");
  if (of_poses.empty()) append(out, diagnose_paths(log));
  if (log.holds_poses_only) {  // its motions are those of the poses
    if (out.empty()) out = diagnose_missing_rotations(given, truth, name + ", estimated poses of objects");
    append(out, of_camera);
    return out;
  }

  const Trajectory& true_camera = holds_poses(log.true_camera) ? log.true_camera : log.camera;
  const std::vector<ObjectExplanation> of_truth = explain_motions(
      motion_data(truth, log.frame, log.true_poses, true_camera, steps_between(log.true_poses, log.frame)));
  append(out, diagnoses_of(of_truth, name + ", true motions against the true poses"));
  if (of_truth.empty())
    append(out, diagnoses_of(explain_by_motions(log.true_poses, truth, log, true_camera),
                             name + ", true poses against the true motions"));

  const Motions& L = log.true_poses.empty() ? log.poses : log.true_poses;
  const Trajectory& camera = log.camera.empty() ? true_camera : log.camera;
  const auto reference = [&](ObjectFrame key, const MotionSample&) { return find_pose(truth, key); };
  MotionData of_log = motion_data(given, log.frame, L, camera, reference);
  Motions not_logged = truth;
  std::erase_if(not_logged, [&](const auto& motion) { return given.contains(motion.first); });
  of_log.T_true_estimated = W;
  of_log.not_logged = motion_data(not_logged, log.frame, L, camera, reference).samples;
  std::vector<ObjectExplanation> of_estimate = explain_motions(of_log);
  for (ObjectExplanation& found : of_estimate) {
    name_frames_of_both(log, found.explanation.best);
    for (Reading& reading : found.explanation.alike) name_frames_of_both(log, reading);
  }
  // If the truth itself looks wrong, the estimates differ from it for that reason.
  if (of_truth.empty()) append(out, diagnoses_of(of_estimate, name + ", estimated motions"));
  if (of_estimate.empty())
    append(out, diagnose_missing_rotations(given, truth, name + ", estimated motions"));

  if (of_poses.empty()) {
    for (const ObjectExplanation& own : explain_by_own_poses(log, given)) {
      if (!any_allows(of_estimate, own.code()) && !any_allows(of_truth, own.code()))
        out.push_back({own.code(), own.text(name + against_own_poses)});
    }
  }
  if (out.empty()) append(out, diagnose_direction(log, truth.empty() ? given : truth));
  append(out, of_camera);
  return out;
}

std::vector<DataWarning> diagnose_log(const ObjectLog& as_read, const SequenceTruth& truth) {
  const ObjectLog log = moved(as_read, truth);
  const std::string& name = log.estimator;
  const Motions given = estimates(log);
  std::vector<DataWarning> out = diagnose_rotations(given, name + ", estimated motions");
  // Uses the log as read: moved to another world, an inverse pose is no longer the inverse of a camera pose.
  append(out, diagnose_camera(as_read.camera, truth.camera, name + ", estimated camera"));
  if (!out.empty() && out.front().code.starts_with("quaternion")) return out;

  const Motions L = true_object_poses(truth);
  const Trajectory& camera = log.camera.empty() ? truth.camera : log.camera;
  const std::set<int> ids = ids_of(given), true_ids = ids_of(L);
  const auto motions_of = [&](int id, int true_id) {
    const Motions path = of_object(L, true_id, id);
    return motion_data(of_object(given, id, id), log.frame, path, camera, steps_between(path, log.frame));
  };
  if (!log.holds_poses_only)
    append(out, diagnoses_of(group_by_reading(explain_by_best_match(
                                                  ids, true_ids, motion_hypotheses(log.frame), motions_of,
                                                  motion_residual, null_of_motions, stillness_residual),
                                              ids.size()),
                             name + ", estimated motions"));
  if (out.empty()) {
    // All objects together, each with the true object that it fits best as declared.
    MotionData all{log.frame, {}, given};
    for (const int id : ids) {
      std::optional<MotionData> best;
      for (const int true_id : true_ids) {
        MotionData data = motions_of(id, true_id);
        const auto left = motion_residual(data);
        if (left && (!best || *left < *motion_residual(*best))) best = std::move(data);
      }
      if (best) std::ranges::move(best->samples, std::back_inserter(all.samples));
    }
    if (const auto shift = explain_hidden_shift(all))
      out.push_back({shift->best.code, message(*shift, name + ", estimated motions", "m")});
  }
  if (out.empty()) {
    Motions steps;
    for (const auto& [key, pose] : L) {
      if (const auto H = world_step(L, key)) steps.emplace(key, *H);
    }
    out = diagnose_missing_rotations(given, steps, name + ", estimated motions");
  }
  const auto poses_of = [&](int id, int true_id) {
    return PoseData{SharedFrame::world, of_object(log.poses, id, id), of_object(L, true_id, id),
                    log.camera.poses()};
  };
  const std::set<int> with_poses = ids_of(log.poses);
  append(out, diagnoses_of(
                  group_by_reading(explain_by_best_match(with_poses, true_ids, pose_hypotheses(), poses_of,
                                                         pose_residual, null_of_poses, no_residual),
                                   with_poses.size()),
                  name + ", estimated poses of objects"));
  if (out.empty()) append(out, diagnoses_of(explain_by_own_poses(log, given), name + against_own_poses));
  return out;
}

std::vector<DataWarning> diagnose_disagreement(const ObjectLog& log) {
  std::vector<DataWarning> out;
  for (const DataWarning& found : disagreements_of(matched_motions(log)))
    out.push_back({found.code, fmt::format("{}, estimated motions: {}", log.estimator, found.text)});
  if (out.empty()) {
    if (auto found = diagnose_object_axes(log)) out.push_back(std::move(*found));
  }
  return out;
}

}  // namespace sextant
