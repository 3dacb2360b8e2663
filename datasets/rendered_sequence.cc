#include "sextant/datasets/rendered_sequence.h"

#include <cmath>
#include <mutex>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/dataset.h"
#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/frame_cache.h"
#include "sextant/datasets/synthetic/renderer.h"
#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti_layout.h"

namespace sextant {
namespace {

// Incremented whenever any pixel or pose of a scenario changes.
constexpr const char* version = "synthetic scenes version 5";

class RenderedSequence final : public Sequence {
 public:
  RenderedSequence(const std::function<RenderedSource(InputLog&)>& make, const RenderCacheOptions& options) {
    RenderedSource source = make(inputs());
    info_ = std::move(source.info);
    first_scenario_frame_ = source.first_scenario_frame;
    truth_ = std::move(source.truth);
    renderer_ = std::make_unique<synthetic::Renderer>(std::move(source.scenario));
    const synthetic::Scenario& scenario = renderer_->scenario();
    cache_ = std::make_unique<synthetic::FrameCache>(synthetic::cache_folder(options.cache),
                                                     synthetic::content_key(scenario, version),
                                                     static_cast<uint64_t>(options.cache_max_mb) << 20U);
    info_.camera = scenario.camera;
    info_.rate_hz = scenario.rate_hz;
    info_.width = scenario.width;
    info_.height = scenario.height;
    info_.channels = Channels::all();
    info_.exact = info_.channels;
    info_.provenance.emplace_back(std::string("images: rendered, ") + version);
    info_.provenance.emplace_back("depth: rendered, exact");
    info_.provenance.emplace_back("flow: rendered, exact");
    info_.provenance.emplace_back("masks: rendered, exact");
  }

  const SequenceInfo& info() const override { return info_; }
  /// Computed on first use, because the visibility of objects requires the geometry of every frame.
  const SequenceTruth& truth() const override {
    std::call_once(truth_once_, [&] {
      if (!truth_) truth_ = renderer_->truth(info_.first_frame, info_.last_frame);
    });
    return *truth_;
  }
  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, name());
    Channels missing = channels;
    missing.rgb = channels.rgb || channels.gray;
    missing.gray = false;
    const int scenario_frame = frame - first_scenario_frame_;
    Frame out;
    each_channel(missing, out, out, [&](const char* channel, bool& wanted, auto& image, auto&) {
      if (wanted && cache_->load(scenario_frame, channel, info_.width, info_.height, image)) wanted = false;
    });
    Frame rendered = renderer_->render(scenario_frame, missing);
    each_channel(missing, out, rendered, [&](const char* channel, bool wanted, auto& image, auto& made) {
      if (!wanted) return;
      cache_->store(scenario_frame, channel, made);
      image = std::move(made);
    });
    out.index = frame;
    if (channels.gray) out.gray = rgb_to_gray(out.rgb);
    if (!channels.rgb) out.rgb = {};
    return out;
  }
  std::optional<Image<Flow>> true_flow(int frame) const override {
    check_frame(info_, frame, name());
    Image<Flow> flow = read(frame, {.flow = true}).flow;
    if (flow.empty()) return std::nullopt;
    return flow;
  }
  void check_files() const override {}  // frames are rendered on demand

 private:
  /// Calls visit(name, wanted, image of a, image of b) for each channel except gray.
  template <typename Visit>
  static void each_channel(Channels& channels, Frame& a, Frame& b, const Visit& visit) {
    visit("rgb", channels.rgb, a.rgb, b.rgb);
    visit("rgb_right", channels.rgb_right, a.rgb_right, b.rgb_right);
    visit("depth", channels.depth, a.depth_m, b.depth_m);
    visit("flow", channels.flow, a.flow, b.flow);
    visit("backward_flow", channels.backward_flow, a.backward_flow, b.backward_flow);
    visit("mask", channels.mask, a.mask, b.mask);
    visit("occlusion", channels.occlusion, a.occlusion, b.occlusion);
  }
  std::string name() const { return info_.dataset + ":" + info_.sequence; }

  std::unique_ptr<synthetic::Renderer> renderer_;
  std::unique_ptr<synthetic::FrameCache> cache_;
  SequenceInfo info_;
  int first_scenario_frame_ = 0;
  mutable std::once_flag truth_once_;
  mutable std::optional<SequenceTruth> truth_;
};

}  // namespace

std::unique_ptr<Sequence> open_rendered(const std::function<RenderedSource(InputLog&)>& make,
                                        const RenderCacheOptions& options) {
  return std::make_unique<RenderedSequence>(make, options);
}

void SyntheticOptions::check() const {
  RenderCacheOptions::check();
  check_option(every >= 1, "every", every, ">= 1");
}

std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source) {
  SyntheticOptions options;
  read_options(source.options, options, "synthetic");
  if (!source.sequence.empty()) {
    fail("source '{}': a synthetic source has no '#': expected synthetic:scenario[@first-last]", source.text);
  }
  return open_rendered(
      [&](InputLog&) {
        RenderedSource rendered;
        rendered.scenario = synthetic::every_nth_frame(synthetic::make_scenario(source.path), options.every);
        rendered.info.dataset = source.adapter;
        rendered.info.sequence = rendered.scenario.name;
        std::set<int> frames;
        for (int frame = 0; frame < rendered.scenario.n_frames(); ++frame) frames.insert(frames.end(), frame);
        choose_frames(source, frames, "synthetic:" + source.path, rendered.info);
        return rendered;
      },
      options);
}

namespace {

/// Turns the chosen frames of a sequence with this `info` and `truth` into a scenario; `shape` has the image
/// size.
RenderedSource replay_of(SequenceInfo info, SequenceTruth truth, synthetic::Scenario shape) {
  shape.name = info.dataset + ":" + info.sequence;
  shape.camera = info.camera;
  shape.rate_hz = info.rate_hz;
  RenderedSource rendered{
      .scenario = synthetic::replay_scenario(truth, info.first_frame, info.last_frame, std::move(shape)),
      .first_scenario_frame = info.first_frame};
  info.provenance.emplace_back("scene: true motions from the text files, synthetic shapes and street");
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
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "finite and > 0");
  check_option(std::isfinite(bf) && bf > 0, "bf", bf, "finite and > 0");
}

void ReplayKittiOptions::check() const {
  KittiTruthOptions::check();
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "finite and > 0");
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
