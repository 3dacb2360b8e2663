#include "sextant/datasets/replay.h"

#include <cmath>
#include <functional>

#include "sextant/datasets/frame_range.h"
#include "sextant/datasets/synthetic/renderer.h"
#include "sextant/datasets/synthetic/replay_scenario.h"
#include "sextant/datasets/vkitti1_truth.h"

namespace sextant {
namespace {

/// What the text files of a sequence say.
struct ReplaySource {
  SequenceInfo info;
  SequenceTruth truth;
};

class Replay final : public Sequence {
 public:
  explicit Replay(const std::function<ReplaySource(InputLog&)>& read_text) {
    ReplaySource source = read_text(inputs());
    info_ = std::move(source.info);
    truth_ = std::move(source.truth);
    renderer_ = std::make_unique<synthetic::Renderer>(scenario(info_, truth_));
    info_.channels = {.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
    info_.provenance.emplace_back("images, depth, flow, masks: rendered from the true motions, exact");
  }

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, name());
    Frame out = renderer_->render(frame - info_.first_frame, channels);
    out.index = frame;
    return out;
  }
  std::optional<Image<Flow>> true_flow(int frame) const override {
    Image<Flow> flow = read(frame, {.flow = true}).flow;
    if (flow.empty()) return std::nullopt;
    return flow;
  }
  void check_files() const override {}  // all of them were read

 private:
  std::string name() const { return info_.dataset + ":" + info_.sequence; }

  static synthetic::Scenario scenario(const SequenceInfo& info, const SequenceTruth& truth) {
    synthetic::Scenario shape;
    shape.name = info.dataset + ":" + info.sequence;
    shape.camera = info.camera;
    shape.width = info.width;
    shape.height = info.height;
    shape.rate_hz = info.rate_hz;
    return synthetic::replay_scenario(truth, info.first_frame, info.last_frame, std::move(shape));
  }

  SequenceInfo info_;
  SequenceTruth truth_;
  std::unique_ptr<synthetic::Renderer> renderer_;
};

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
  const size_t slash = source.sequence.find('/');
  const std::string world = source.sequence.substr(0, slash);
  const std::string variation = slash == std::string::npos ? "clone" : source.sequence.substr(slash + 1);
  return std::make_unique<Replay>([&](InputLog& inputs) {
    Vkitti1Truth text = read_vkitti1_truth(source.path, world, variation, inputs);
    ReplaySource replay;
    replay.truth = std::move(text.truth);
    replay.info.dataset = source.adapter;
    replay.info.sequence = world + "/" + variation;
    replay.info.camera = synthetic::Scenario::virtual_kitti_camera();
    replay.info.camera.bf = options.bf;
    replay.info.rate_hz = options.rate_hz;
    replay.info.width = 1242;
    replay.info.height = 375;
    replay.info.warnings = std::move(text.warnings);
    choose_frames(source, frames_of(replay.truth), source.path + "#" + source.sequence, replay.info);
    return replay;
  });
}

std::unique_ptr<Sequence> open_replay_kitti(const SourceSpec& source) {
  ReplayKittiOptions options;
  read_options(source.options, options, source.adapter);
  return std::make_unique<Replay>([&](InputLog& inputs) {
    KittiTruth text = read_kitti_truth(source.path, source.sequence, options, inputs);
    if (text.n_poses == 0) {
      fail("{}: no training/oxts/{}.txt: a replay needs the camera's motion", source.path, source.sequence);
    }
    ReplaySource replay;
    replay.truth = std::move(text.truth);
    replay.info.dataset = source.adapter;
    replay.info.sequence = source.sequence;
    replay.info.camera = text.camera;
    replay.info.rate_hz = options.rate_hz;
    const KittiImageSize size = kitti_image_size(source.path, source.sequence, inputs);
    replay.info.width = size.width;
    replay.info.height = size.height;
    replay.info.warnings = std::move(text.warnings);
    replay.info.provenance = std::move(text.provenance);
    choose_frames(source, frames_of(replay.truth), source.path + "#" + source.sequence, replay.info);
    return replay;
  });
}

}  // namespace sextant
