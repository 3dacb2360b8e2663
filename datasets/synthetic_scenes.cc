#include "sextant/datasets/synthetic_scenes.h"

#include <mutex>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/frame_range.h"
#include "sextant/datasets/synthetic/frame_cache.h"
#include "sextant/datasets/synthetic/renderer.h"

namespace sextant {
namespace {

// Raised whenever any pixel or pose of a scenario changes.
constexpr const char* version = "synthetic scenes version 3";

class RenderedSequence final : public Sequence {
 public:
  RenderedSequence(const SourceSpec& source, const SyntheticOptions& options)
      : renderer_(synthetic::make_scenario(source.path)),
        cache_(synthetic::cache_folder(options.cache), synthetic::content_key(renderer_.scenario(), version),
               static_cast<uint64_t>(options.cache_max_mb) << 20U) {
    const int last = renderer_.scenario().n_frames() - 1;
    info_.dataset = "synthetic";
    info_.sequence = source.path;
    std::set<int> frames;
    for (int frame = 0; frame <= last; ++frame) frames.insert(frames.end(), frame);
    choose_frames(source, frames, name(), info_);
    const synthetic::Scenario& scenario = renderer_.scenario();
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
    info_.provenance = {std::string("images: rendered, ") + version, "depth: rendered, exact",
                        "flow: rendered, exact", "masks: rendered, exact"};
  }

  const SequenceInfo& info() const override { return info_; }
  /// Found when first asked for: which objects are seen takes the geometry of every frame.
  const SequenceTruth& truth() const override {
    std::call_once(truth_once_, [&] { truth_ = renderer_.truth(info_.first_frame, info_.last_frame); });
    return truth_;
  }
  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, name());
    Channels missing = channels;
    missing.rgb = channels.rgb || channels.gray;
    missing.gray = false;
    Frame out;
    each_channel(out, missing, [&](const char* channel, bool& wanted, auto& image) {
      if (wanted && cache_.load(frame, channel, info_.width, info_.height, image)) wanted = false;
    });
    Frame rendered = renderer_.render(frame, missing);
    each_channel(rendered, missing, [&](const char* channel, bool& wanted, auto& image) {
      if (wanted) cache_.store(frame, channel, image);
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
  void check_files() const override {}  // there are none

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
  std::string name() const { return "synthetic:" + renderer_.scenario().name; }

  synthetic::Renderer renderer_;
  synthetic::FrameCache cache_;
  SequenceInfo info_;
  mutable std::once_flag truth_once_;
  mutable SequenceTruth truth_;
};

}  // namespace

std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source) {
  SyntheticOptions options;
  read_options(source.options, options, "synthetic");
  if (!source.sequence.empty()) {
    fail("source '{}': a synthetic source has no '#': expected synthetic:scenario[@first-last]", source.text);
  }
  return std::make_unique<RenderedSequence>(source, options);
}

}  // namespace sextant
