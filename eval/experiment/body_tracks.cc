#include "sextant/eval/experiment/case_runner.h"

namespace sextant {
namespace {

std::optional<Eigen::Vector3d> position(const std::optional<SE3>& pose) {
  if (!pose) return std::nullopt;
  return pose->translation();
}

std::optional<Eigen::Vector3d> true_origin(const SequenceTruth& truth, int frame, int id) {
  const ObjectTruth* object = truth.find(frame, id);
  const std::optional<SE3> T_world_camera = truth.camera.pose(frame);
  if (object == nullptr || !T_world_camera) return std::nullopt;
  return *T_world_camera * object->T_camera_object.translation();
}

BodyTrack camera_track(const CaseMotions& motions, const SequenceTruth& truth, const SequenceInfo& info) {
  BodyTrack track{"ego", {}};
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    track.points.push_back(
        {frame, position(motions.estimated.pose(frame)), position(truth.camera.pose(frame))});
  }
  return track;
}

BodyTrack object_track(int id, const std::map<int, SE3>& motions, const SequenceTruth& truth,
                       const SequenceInfo& info) {
  BodyTrack track{object_body(id), {}};
  std::optional<Eigen::Vector3d> estimate;
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    const std::optional<Eigen::Vector3d> true_m = true_origin(truth, frame, id);
    const auto motion = motions.find(frame);
    if (motion == motions.end()) estimate.reset();
    if (motion != motions.end() && estimate) estimate = motion->second * *estimate;
    if (!estimate && motions.contains(frame + 1)) estimate = true_m;  // a stretch begins
    if (estimate || true_m) track.points.push_back({frame, estimate, true_m});
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

}  // namespace sextant
