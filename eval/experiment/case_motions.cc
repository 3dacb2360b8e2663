#include "sextant/eval/experiment/case_motions.h"

#include <algorithm>
#include <string_view>

#include "sextant/eval/diagnosis/pose_readings.h"
#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

TrackPoint track_point(int frame, const std::optional<SE3>& estimate, const std::optional<SE3>& truth) {
  TrackPoint point{.frame = frame};
  if (estimate) point.set_estimate(*estimate);
  if (truth) point.set_truth(*truth);
  return point;
}

/// T_world_object.
std::optional<SE3> true_pose(const SequenceTruth& truth, int frame, int id) {
  const ObjectTruth* object = truth.find(frame, id);
  const std::optional<SE3> T_world_camera = truth.camera.pose(frame);
  if (object == nullptr || !T_world_camera) return std::nullopt;
  return *T_world_camera * object->T_camera_object;
}

BodyTrack camera_track(const CaseMotions& motions, const SequenceTruth& truth, const SequenceInfo& info) {
  BodyTrack track{"ego", {}};
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame)
    track.points.push_back(track_point(frame, motions.estimated.pose(frame), truth.camera.pose(frame)));
  return track;
}

BodyTrack object_track(int id, const std::map<int, SE3>& motions, const SequenceTruth& truth,
                       const SequenceInfo& info) {
  BodyTrack track{object_body(id), {}};
  std::optional<SE3> estimate;
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    const std::optional<SE3> truth_pose = true_pose(truth, frame, id);
    const auto motion = motions.find(frame);
    if (motion == motions.end()) estimate.reset();
    if (motion != motions.end() && estimate) estimate = motion->second * *estimate;
    if (!estimate && motions.contains(frame + 1))
      estimate = truth_pose;  // a new sequence of estimates begins
    if (estimate || truth_pose) track.points.push_back(track_point(frame, estimate, truth_pose));
  }
  return track;
}

}  // namespace

std::vector<BodyTrack> body_tracks(const CaseMotions& motions, const SequenceTruth& truth,
                                   const SequenceInfo& info) {
  std::vector<BodyTrack> tracks = {camera_track(motions, truth, info)};
  for (const auto& [id, of_object] : motions.objects) {
    BodyTrack track = object_track(id, of_object, truth, info);
    if (!track.points.empty()) tracks.push_back(std::move(track));
  }
  return tracks;
}

std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator, const RecordedForm& recorded) {
  const MotionFrame declared = recorded.declared;
  std::vector<std::string> out;
  const auto add_lines = [&](const std::vector<ObjectExplanation>& found, const char* what) {
    for (const ObjectExplanation& explanation : found) {
      std::string text = explanation.text(fmt::format("{}, {}", estimator, what));
      // For an external program the remedy is a key of its configuration instead of a flag or an edit.
      using Key = std::pair<std::string_view, std::string_view>;
      for (const auto& [edit, key] :
           {Key("give --frame ", "declare objects.frame as "),
            Key(": invert each pose", ": declare camera.inverse, or invert each pose")}) {
        if (const size_t at = text.find(edit); at != std::string::npos) text.replace(at, edit.size(), key);
      }
      out.push_back(std::move(text));
    }
  };
  PoseData cameras{SharedFrame::body, {}, {}, {}};
  cameras.quaternions = recorded.camera_has_quaternions;
  const Trajectory& estimated = recorded.camera != nullptr ? *recorded.camera : motions.estimated;
  for (const auto& [frame, pose] : estimated.poses()) cameras.given.emplace(ObjectFrame(0, frame), pose);
  for (const auto& [frame, pose] : truth.camera.poses())
    cameras.reference.emplace(ObjectFrame(0, frame), pose);
  add_lines(explain_poses(cameras), "estimated camera");
  // Motions of objects are given in the world of the estimated camera, so they cannot be judged without it.
  if (!out.empty()) return out;
  const RepeatedCameraPoses repeated = repeated_camera_poses(cameras);
  if (repeated.frames.size() >= 2) {
    out.push_back(fmt::format("{}: the estimated camera {}", estimator, repeated.text()));
    if (repeated.frames.size() == repeated.n_steps) return out;
  }

  // A motion as logged, in the declared frame: the inverse of the conversion to the world of `motions`.
  const auto as_logged = [&](const SE3& H, const MotionSample& at) -> std::optional<SE3> {
    const auto before = motions.estimated.pose(at.key.second - 1);
    const auto after = motions.estimated.pose(at.key.second);
    if (!before || !after) return std::nullopt;
    return change_frame(after->inverse() * H * *before, MotionFrame::camera, declared, at);
  };
  MotionData data{declared, {}, {}};
  data.quaternions = recorded.motions_have_quaternions;
  size_t n_identical = 0, n_moving = 0;  // motions that are the identity while the object moves
  for (const auto& [frame, objects] : truth.objects) {
    const auto before = estimated.pose(frame), after = estimated.pose(frame + 1);
    // Steps in which a lost tracker repeats its pose say nothing about what the others mean.
    if (!before || !after || std::ranges::binary_search(repeated.frames, frame + 1)) continue;
    for (const ObjectTruth& object : objects) {
      MotionSample sample{{object.id, frame + 1}, {}, {}, *before * object.T_camera_object, before, after};
      const auto of_object = motions.objects.find(object.id);
      std::optional<SE3> given;
      if (of_object != motions.objects.end()) {
        const auto H = of_object->second.find(frame + 1);
        if (H != of_object->second.end()) given = as_logged(H->second, sample);
        const auto from = true_pose(truth, frame, object.id), to = true_pose(truth, frame + 1, object.id);
        if (given && from && to && moves(from->inverse() * *to)) {
          ++n_moving;
          const auto in_camera = change_frame(*given, declared, MotionFrame::camera, sample);
          if (is_identity(H->second) || (in_camera && is_identity(*in_camera))) {
            ++n_identical;
            continue;
          }
        }
      }
      if (given) data.logged.emplace(sample.key, *given);
      const auto X = truth.object_motion(object.id, frame, frame + 1);
      if (!X || !motions.estimated.pose(frame) || !motions.estimated.pose(frame + 1)) continue;
      sample.given = given.value_or(SE3());
      sample.reference = *change_frame(*X, MotionFrame::camera, declared, sample);
      (given ? data.samples : data.not_logged).push_back(sample);
    }
  }
  // Motions where the object has no true pose; in the body frame they would need it.
  for (const auto& [id, of_object] : motions.objects) {
    for (const auto& [frame, H] : of_object) {
      const ObjectFrame key(id, frame);
      if (data.logged.contains(key)) continue;
      const MotionSample at{key, {}, {}, std::nullopt, estimated.pose(frame - 1), estimated.pose(frame)};
      if (const auto given = as_logged(H, at)) data.logged.emplace(key, *given);
    }
  }
  if (n_identical >= 2) {
    out.push_back(fmt::format(
        "{}, estimated motions: {} of {} are exactly the identity while the object moves: motions "
        "that were never estimated? Leave them out, then they count against coverage",
        estimator, n_identical, n_moving));
  }
  std::ranges::sort(data.samples, {}, &MotionSample::key);
  const std::vector<ObjectExplanation> found = explain_motions(data);
  add_lines(found, "estimated motions");
  if (!found.empty()) return out;
  for (const DataWarning& disagreement : disagreements_of(data)) {
    if (disagreement.code == "unexplained") continue;  // the noise that was added may cause large errors
    out.push_back(fmt::format("{}, estimated motions: {}", estimator, disagreement.text));
  }
  return out;
}

}  // namespace sextant
