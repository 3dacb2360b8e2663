#include "sextant/eval/external/noisy_sequence.h"

namespace sextant {

NoisySequence::NoisySequence(const Sequence& base, Noise noise, uint64_t seed, bool with_truth)
    : base_(base),
      noise_(std::move(noise)),
      draws_(seed, base.info().dataset, base.info().sequence),
      info_(base.info()) {
  info_.exact = {};
  info_.times_s.clear();  // frames are at number / rate
  if (with_truth) truth_ = base.truth();
}

Frame NoisySequence::read(int frame, Channels channels) const {
  if (noise_.none()) return base_.read(frame, channels);
  Channels needed = channels;
  needed.mask = channels.mask || channels.flow || channels.backward_flow;  // noise by body
  Frame out = noise_.apply(base_.read(frame, needed), info_.camera, draws_).frame;
  if (!channels.mask) out.mask = {};
  return out;
}

}  // namespace sextant
