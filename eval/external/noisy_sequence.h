#pragma once

// What a program of somebody else is shown of a sequence: its frames with the noise of a case, the same
// numbers that estimators inside get at the same pixels (noise.h), frames at number / rate, and no ground
// truth unless asked for.

#include "sextant/datasets/dataset.h"
#include "sextant/noise/noise.h"

namespace sextant {

class NoisySequence final : public Sequence {
 public:
  /// `base` must live as long as this.
  NoisySequence(const Sequence& base, Noise noise, uint64_t seed, bool with_truth);

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
};

}  // namespace sextant
