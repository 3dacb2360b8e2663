#pragma once

// The frames in which each body is worst, with what the estimator saw of it there: found while a run goes, pair by
// pair, so that nothing has to be estimated again to draw them.

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/metrics/presets.h"

namespace sextant {

struct WorstFrame {
  Record record;
  BodyResult result;
  int prev = 0;     ///< the frame to draw on; the record's is the current one
  double Et_m = 0;  ///< as the preset has it
};

class WorstFrames {
 public:
  static constexpr size_t n_frames = 3;

  explicit WorstFrames(const MetricPreset& preset) : preset_(preset) {}

  /// A PairObserver. Of an estimator with several results the first counts.
  void add(const FrameResult& result, std::span<const Record> of_pair);
  /// Whether pairs of these frames were seen.
  bool has_seen(const SequenceInfo& info) const;
  /// By body_order(): the largest E_t first, of equal ones the earlier frame. Empty where no pair was seen.
  const std::map<int, std::vector<WorstFrame>>& of(const SequenceInfo& info) const;

 private:
  struct OfSequence {
    std::set<int> frames;
    std::map<int, std::vector<WorstFrame>> bodies;
  };
  const MetricPreset& preset_;
  std::map<std::pair<std::string, std::string>, OfSequence> sequences_;
};

}  // namespace sextant
