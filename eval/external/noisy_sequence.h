#pragma once

// What a program of somebody else is shown of a sequence: its frames with the noise of a case, the same
// numbers that estimators inside get at the same pixels (noise.h), frames at number / rate, and no ground
// truth unless asked for. Frames may be numbered from 0, and the last one may have a flow of zeros.

#include "sextant/datasets/dataset.h"
#include "sextant/noise/noise.h"

namespace sextant {

struct ShownSequence {
  bool truth = false;
  bool from_zero = false;       ///< the first frame is 0, whatever it is in the source
  bool zero_last_flow = false;  ///< the last frame, which has no next one, has a flow all the same
};

class NoisySequence final : public Sequence {
 public:
  /// `base` must live as long as this.
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
