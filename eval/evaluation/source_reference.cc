#include "sextant/eval/evaluation/recorded_files.h"

#include <algorithm>

#include "sextant/datasets/dataset.h"

namespace sextant {
namespace {

std::unique_ptr<Sequence> open(const std::string& source, const std::string& data_root, const Json& options) {
  for (const auto& group : options.items()) {
    if (group.key() != "source")
      fail("unknown option group '{}': a reference has options under 'source'", group.key());
  }
  SourceSpec spec = find_source(source, data_root);
  spec.add_options(options.value("source", Json::object()));
  return open_source(spec);
}

}  // namespace

EgoReference source_reference(const std::string& source, const std::string& data_root, const Json& options,
                              bool every_pose) {
  const std::unique_ptr<Sequence> sequence = open(source, data_root, options);
  const SequenceInfo& info = sequence->info();
  EgoReference reference;
  reference.side.name = source;
  reference.side.format = "source";
  reference.warnings = info.warnings;
  reference.step_floor_m = sequence->truth().camera_step_floor_m;
  reference.floors = truth_floor(*sequence).numbers();
  for (const auto& [frame, pose] : sequence->truth().camera.poses()) {
    if (!every_pose && (frame < info.first_frame || frame > info.last_frame)) continue;
    const auto time = info.times_s.find(frame);
    reference.poses.frames.push_back(frame);
    reference.poses.stamps_s.push_back(time != info.times_s.end() ? time->second : frame / info.rate_hz);
    reference.poses.add(pose.rotation().toRotationMatrix(), pose.translation());
  }
  if (reference.poses.empty()) fail("{}: has no true camera poses to compare with", source);
  if (!std::is_sorted(reference.poses.stamps_s.begin(), reference.poses.stamps_s.end()))
    fail("{}: its time stamps do not ascend with its frames", source);
  return reference;
}

SourceObjects source_objects(const std::string& source, const std::string& data_root, const Json& options) {
  const std::unique_ptr<Sequence> sequence = open(source, data_root, options);
  SequenceTruth truth = sequence->truth();
  std::erase_if(truth.objects, [&](const auto& at) {
    return at.first < sequence->info().first_frame || at.first > sequence->info().last_frame;
  });
  if (truth.objects.empty()) fail("{}: has no true objects to compare with", source);
  return {std::move(truth), sequence->info().rate_hz};
}

}  // namespace sextant
