#include "sextant/datasets/synthetic_scenes.h"

#include <mutex>

#include "sextant/datasets/frame_range.h"
#include "sextant/datasets/synthetic/renderer.h"

namespace sextant {
namespace {

// Raised whenever any pixel or pose of a scenario changes.
constexpr const char* version = "synthetic scenes version 2";

class RenderedSequence final : public Sequence {
 public:
  explicit RenderedSequence(const SourceSpec& source) : renderer_(synthetic::make_scenario(source.path)) {
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
    return renderer_.render(frame, channels);
  }
  std::optional<Image<Flow>> true_flow(int frame) const override {
    check_frame(info_, frame, name());
    Image<Flow> flow = renderer_.render(frame, {.flow = true}).flow;
    if (flow.empty()) return std::nullopt;
    return flow;
  }
  void check_files() const override {}  // there are none

 private:
  std::string name() const { return "synthetic:" + renderer_.scenario().name; }

  synthetic::Renderer renderer_;
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
  return std::make_unique<RenderedSequence>(source);
}

}  // namespace sextant
