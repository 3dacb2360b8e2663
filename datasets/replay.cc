#include "sextant/datasets/replay.h"

#include <cmath>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/rendered_sequence.h"
#include "sextant/datasets/synthetic/replay_scenario.h"
#include "sextant/datasets/vkitti1_truth.h"
#include "sextant/datasets/vkitti_files.h"

namespace sextant {
namespace {

/// The chosen frames of a sequence, of which `info` and `truth` are known, as a scenario; `shape` has the
/// size of the images.
RenderedSource replay_of(SequenceInfo info, SequenceTruth truth, synthetic::Scenario shape) {
  shape.name = info.dataset + ":" + info.sequence;
  shape.camera = info.camera;
  shape.rate_hz = info.rate_hz;
  RenderedSource rendered{
      .scenario = synthetic::replay_scenario(truth, info.first_frame, info.last_frame, std::move(shape)),
      .first_scenario_frame = info.first_frame};
  info.provenance.emplace_back("scene: true motions of the text files, shapes and street are ours");
  rendered.info = std::move(info);
  rendered.truth = std::move(truth);
  return rendered;
}

std::set<int> frames_of(const SequenceTruth& truth) {
  std::set<int> frames;
  for (const auto& [frame, pose] : truth.camera.poses()) frames.insert(frame);
  return frames;
}

}  // namespace

void ReplayVkitti1Options::check() const {
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "> 0");
  check_option(std::isfinite(bf) && bf > 0, "bf", bf, "> 0");
}

void ReplayKittiOptions::check() const {
  KittiTruthOptions::check();
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "> 0");
}

std::unique_ptr<Sequence> open_replay_vkitti1(const SourceSpec& source) {
  ReplayVkitti1Options options;
  read_options(source.options, options, source.adapter);
  const VkittiName name = parse_vkitti1_name(source.sequence);
  return open_rendered(
      [&](InputLog& inputs) {
        Vkitti1Truth text = read_vkitti1_truth(source.path, name.group, name.variation, inputs);
        SequenceInfo info{.dataset = source.adapter,
                          .sequence = name.text(),
                          .camera = synthetic::Scenario::virtual_kitti_camera()};
        info.camera.bf = options.bf;
        info.rate_hz = options.rate_hz;
        info.warnings = std::move(text.warnings);
        choose_frames(source, frames_of(text.truth), source.path + "#" + source.sequence, info);
        return replay_of(std::move(info), std::move(text.truth), /*shape=*/{});
      },
      options.render);
}

std::unique_ptr<Sequence> open_replay_kitti(const SourceSpec& source) {
  ReplayKittiOptions options;
  read_options(source.options, options, source.adapter);
  return open_rendered(
      [&](InputLog& inputs) {
        KittiTruth text = read_kitti_truth(source.path, source.sequence, options, inputs);
        if (text.n_poses == 0) {
          fail("{}: no training/oxts/{}.txt: a replay needs the camera's motion", source.path,
               source.sequence);
        }
        SequenceInfo info{.dataset = source.adapter,
                          .sequence = source.sequence,
                          .camera = text.camera,
                          .rate_hz = options.rate_hz};
        const KittiImageSize size = kitti_image_size(source.path, source.sequence, inputs);
        info.warnings = std::move(text.warnings);
        info.provenance = std::move(text.provenance);
        choose_frames(source, frames_of(text.truth), source.path + "#" + source.sequence, info);
        synthetic::Scenario shape{.width = size.width, .height = size.height};
        return replay_of(std::move(info), std::move(text.truth), std::move(shape));
      },
      options.render);
}

}  // namespace sextant
