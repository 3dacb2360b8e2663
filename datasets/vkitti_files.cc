#include "sextant/datasets/vkitti_files.h"

#include <algorithm>

namespace sextant {

FolderFiles vkitti_files(const SequenceTruth& truth) {
  FolderFiles files{.width = vkitti_width, .height = vkitti_height};
  for (const auto& [frame, pose] : truth.camera.poses()) files.frames.insert(frame);
  if (!files.frames.empty()) return files;
  for (const auto& [frame, objects] : truth.objects) files.frames.insert(frame);
  return files;
}

void check_vkitti_frames(const Sequence& sequence, const std::string& root) {
  const SequenceInfo& info = sequence.info();
  const Trajectory& camera = sequence.truth().camera;
  if (camera.empty()) return;
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    if (camera.has(frame)) continue;
    fail(
        "{} {}: the extrinsics have no row of frame {}, of which there are files: take both from the same "
        "sequence, or choose other frames with @first-last",
        root, info.sequence, frame);
  }
}

VkittiName parse_vkitti1_name(const std::string& sequence) {
  const size_t slash = sequence.find('/');
  if (slash == std::string::npos) return {sequence, "clone"};
  return {sequence.substr(0, slash), sequence.substr(slash + 1)};
}

VkittiName parse_vkitti2_name(const std::string& sequence) {
  VkittiName name = parse_vkitti1_name(sequence);
  const bool digits =
      !name.group.empty() && std::ranges::all_of(name.group, [](char c) { return c >= '0' && c <= '9'; });
  if (digits && name.group.size() < 6) name.group = fmt::format("Scene{:02}", std::stoi(name.group));
  return name;
}

}  // namespace sextant
