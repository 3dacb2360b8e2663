#include "sextant/datasets/rendered_sequence.h"

#include <mutex>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/frame_range.h"
#include "sextant/datasets/synthetic/frame_cache.h"
#include "sextant/datasets/synthetic/renderer.h"

namespace sextant {
namespace {

// Raised whenever any pixel or pose of a scenario changes.
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
    info_.channels = {.gray = true,
                      .rgb = true,
                      .rgb_right = true,
                      .depth = true,
                      .flow = true,
                      .backward_flow = true,
                      .mask = true,
                      .occlusion = true};
    info_.exact = info_.channels;
    info_.provenance.emplace_back(std::string("images: rendered, ") + version);
    info_.provenance.emplace_back("depth: rendered, exact");
    info_.provenance.emplace_back("flow: rendered, exact");
    info_.provenance.emplace_back("masks: rendered, exact");
  }

  const SequenceInfo& info() const override { return info_; }
  /// Found when first asked for: which objects are seen takes the geometry of every frame.
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
    Frame out;
    each_channel(out, missing, [&](const char* channel, bool& wanted, auto& image) {
      if (wanted && cache_->load(frame - first_scenario_frame_, channel, info_.width, info_.height, image))
        wanted = false;
    });
    Frame rendered = renderer_->render(frame - first_scenario_frame_, missing);
    each_channel(rendered, missing, [&](const char* channel, bool& wanted, auto& image) {
      if (wanted) cache_->store(frame - first_scenario_frame_, channel, image);
    });
    out.index = frame;
    if (missing.rgb) out.rgb = std::move(rendered.rgb);
    if (missing.rgb_right) out.rgb_right = std::move(rendered.rgb_right);
    if (missing.depth) out.depth_m = std::move(rendered.depth_m);
    if (missing.flow) out.flow = std::move(rendered.flow);
    if (missing.backward_flow) out.backward_flow = std::move(rendered.backward_flow);
    if (missing.mask) out.mask = std::move(rendered.mask);
    if (missing.occlusion) out.occlusion = std::move(rendered.occlusion);
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
  void check_files() const override {}  // made when asked for

 private:
  template <typename Visit>
  static void each_channel(Frame& frame, Channels& channels, const Visit& visit) {
    visit("rgb", channels.rgb, frame.rgb);
    visit("rgb_right", channels.rgb_right, frame.rgb_right);
    visit("depth", channels.depth, frame.depth_m);
    visit("flow", channels.flow, frame.flow);
    visit("backward_flow", channels.backward_flow, frame.backward_flow);
    visit("mask", channels.mask, frame.mask);
    visit("occlusion", channels.occlusion, frame.occlusion);
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

}  // namespace sextant
