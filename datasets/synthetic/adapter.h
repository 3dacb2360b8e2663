#pragma once

// Adapter `synthetic`: scenes that need no download. SOURCE is synthetic:<scenario>[@first-last].
//
// This folder lies below datasets/ in the layers, so the interface that it serves comes as a parameter: the
// table in datasets/registry.cc names open_synthetic<Sequence, SourceSpec>.

#include <memory>
#include <optional>
#include <utility>

#include "sextant/base/options.h"
#include "sextant/datasets/synthetic/renderer.h"

namespace sextant {

/// None so far: a scenario is complete by its name.
struct SyntheticOptions {
  template <typename V>
  void visit(V&) {}
};

namespace synthetic {

/// Raised whenever any pixel or pose of a scenario changes.
inline constexpr const char* kVersion = "synthetic scenes version 1";

template <typename Sequence>
class RenderedSequence final : public Sequence {
 public:
  using Info = std::remove_cvref_t<decltype(std::declval<const Sequence&>().info())>;

  template <typename SourceSpec>
  explicit RenderedSequence(const SourceSpec& source) : renderer_(source.path) {
    const int last = renderer_.scenario().n_frames() - 1;
    info_.dataset = "synthetic";
    info_.sequence = source.path;
    info_.first_frame = source.first.value_or(0);
    info_.last_frame = source.last.value_or(last);
    if (info_.first_frame < 0 || info_.first_frame > info_.last_frame || info_.last_frame > last) {
      fail("synthetic:{}: frames {}-{} asked for, it has frames 0-{}", source.path, info_.first_frame,
           info_.last_frame, last);
    }
    info_.camera = camera();
    info_.rate_hz = kRateHz;
    info_.width = kWidth;
    info_.height = kHeight;
    info_.channels = {.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
    info_.provenance = {std::string("images: rendered, ") + kVersion, "depth: rendered, exact",
                        "flow: rendered, exact", "masks: rendered, exact"};
    truth_ = renderer_.truth(info_.first_frame, info_.last_frame);
  }

  const Info& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override {
    check_frame(frame);
    return renderer_.render(frame, channels);
  }
  std::optional<Image<Flow>> true_flow(int frame) const override {
    check_frame(frame);
    Image<Flow> flow = renderer_.render(frame, {.flow = true}).flow;
    if (flow.empty()) return std::nullopt;
    return flow;
  }
  void check_files() const override {}  // there are none

 private:
  void check_frame(int frame) const {
    if (frame >= info_.first_frame && frame <= info_.last_frame) return;
    fail("synthetic:{}: no frame {}: it has frames {}-{}", info_.sequence, frame, info_.first_frame,
         info_.last_frame);
  }

  Renderer renderer_;
  Info info_;
  SequenceTruth truth_;
};

}  // namespace synthetic

/// Throws Error on an unknown scenario or option, a '#' in the source, or frames that it does not have.
template <typename Sequence, typename SourceSpec>
std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source) {
  SyntheticOptions options;
  read_options(source.options, options);
  if (!source.sequence.empty()) {
    fail("source '{}': a synthetic source has no '#': expected synthetic:scenario[@first-last]", source.text);
  }
  return std::make_unique<synthetic::RenderedSequence<Sequence>>(source);
}

}  // namespace sextant
