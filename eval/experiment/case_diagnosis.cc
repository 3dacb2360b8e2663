#include "sextant/eval/experiment/case_diagnosis.h"

#include <string_view>

#include "sextant/eval/diagnosis/pose_readings.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {

std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator, const Trajectory* recorded_camera) {
  std::vector<std::string> out;
  const auto tell = [&](const std::vector<ObjectExplanation>& found, const char* what) {
    for (const ObjectExplanation& explanation : found) {
      std::string text = explanation.text(fmt::format("{}, {}", estimator, what));
      // What is a flag or an edit elsewhere is a key of the configuration of a program.
      using Key = std::pair<std::string_view, std::string_view>;
      for (const auto& [edit, key] : {Key("give --frame ", "declare objects.frame as "),
                                      Key(": invert each pose", ": declare camera.inverse, or invert each pose")}) {
        if (const size_t at = text.find(edit); at != std::string::npos) text.replace(at, edit.size(), key);
      }
      out.push_back(std::move(text));
    }
  };
  PoseData cameras{SharedFrame::body, {}, {}, {}};
  const Trajectory& estimated = recorded_camera != nullptr ? *recorded_camera : motions.estimated;
  for (const auto& [frame, pose] : estimated.poses()) cameras.given.emplace(ObjectFrame(0, frame), pose);
  for (const auto& [frame, pose] : truth.camera.poses()) cameras.reference.emplace(ObjectFrame(0, frame), pose);
  tell(explain_poses(cameras), "estimated camera");
  // Motions of objects are kept in the world of the estimated camera: no judgement without it.
  if (!out.empty()) return out;

  MotionData data{MotionFrame::world, {}, {}};
  for (const auto& [id, of_object] : motions.objects) {
    for (const auto& [frame, H] : of_object) {
      const auto before = motions.estimated.pose(frame - 1), after = motions.estimated.pose(frame);
      const auto X = truth.object_motion(id, frame - 1, frame);
      const ObjectTruth* object = truth.find(frame - 1, id);
      data.logged.emplace(ObjectFrame(id, frame), H);
      if (!before || !after || !X || object == nullptr) continue;
      data.samples.push_back({{id, frame},
                              H,
                              world_motion(*before, *after, *X),
                              *before * object->T_camera_object,
                              before,
                              after});
    }
  }
  tell(explain_motions(data), "estimated motions");
  return out;
}

}  // namespace sextant
