#pragma once

// The view of a sequence that an external program gets: its frames with the noise of a case, with the same
// values that built-in estimators get at the same pixels (noise.h), frames at number / rate, and ground truth
// only if requested. Frames may be numbered from 0, and the last one may have a flow of zeros.

#include "sextant/datasets/dataset.h"
#include "sextant/noise/noise.h"

namespace sextant {

struct ShownSequence {
  bool truth = false;
  bool from_zero = false;       ///< numbers the first frame 0, whatever its number in the source
  bool zero_last_flow = false;  ///< adds zero flow to the last frame, which has no successor
};

class NoisySequence final : public Sequence {
 public:
  /// `base` must outlive this object.
  NoisySequence(const Sequence& base, Noise noise, uint64_t seed, const ShownSequence& shown);

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override;
  void check_files() const override { base_.check_files(); }

 private:
  const Sequence& base_;
  Noise noise_;
  Draws draws_;
  SequenceInfo info_;
  SequenceTruth truth_;
  int shift_ = 0;  ///< from frame numbers here to those of the source
  bool zero_last_flow_ = false;
};

}  // namespace sextant
