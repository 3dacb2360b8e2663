#include "sextant/eval/external/noisy_sequence.h"

namespace sextant {

NoisySequence::NoisySequence(const Sequence& base, Noise noise, uint64_t seed, const ShownSequence& shown)
    : base_(base),
      noise_(std::move(noise)),
      draws_(seed, base.info().dataset, base.info().sequence),
      info_(base.info()),
      shift_(shown.from_zero ? base.info().first_frame : 0),
      zero_last_flow_(shown.zero_last_flow) {
  info_.exact = {};
  info_.times_s.clear();  // frames are at number / rate
  info_.first_frame -= shift_;
  info_.last_frame -= shift_;
  if (!shown.truth) return;
  truth_.camera_step_floor_m = base.truth().camera_step_floor_m;
  for (const auto& [frame, pose] : base.truth().camera.poses()) truth_.camera.set(frame - shift_, pose);
  for (const auto& [frame, objects] : base.truth().objects) truth_.objects[frame - shift_] = objects;
}

Frame NoisySequence::read(int frame, Channels channels) const {
  Channels needed = channels;
  // the noise depends on the body
  needed.mask = channels.mask || (!noise_.none() && (channels.flow || channels.backward_flow));
  Frame out = base_.read(frame + shift_, needed);
  if (!noise_.none()) out = noise_.apply(std::move(out), info_.camera, draws_).frame;
  if (!channels.mask) out.mask = {};
  out.index = frame;
  if (channels.flow && zero_last_flow_ && frame == info_.last_frame && out.flow.empty())
    out.flow = Image<Flow>(info_.width, info_.height, {0, 0});
  return out;
}

}  // namespace sextant
