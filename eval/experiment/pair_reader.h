#pragma once

// Extracts the points of a source's frame pairs. Every frame is decoded once; only the dense data needed for
// the pairs' points are kept: an estimator uses a few thousand correspondences, not images.

#include <optional>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/measurement/problem.h"
#include "sextant/noise/noise.h"

namespace sextant {

/// Throws Error unless a source has two frames, images, depth, flow and masks, and all their files.
void check_runnable(const SourceSpec& spec, const Sequence& sequence);

/// True flow at some pixels of one frame.
class FlowSamples {
 public:
  struct Sample {
    int x = 0, y = 0;
    Flow flow;
  };

  FlowSamples() = default;
  /// Takes samples in any order; if a pixel has several samples, the first one is used.
  explicit FlowSamples(std::vector<Sample> samples);
  /// Returns the flow at a pixel; invalid if there is no sample.
  Flow at(int x, int y) const;
  const std::vector<Sample>& samples() const { return samples_; }  ///< by row, then column

 private:
  std::vector<Sample> samples_;
};

/// Samples `dense` at the pixels of all points of a pair.
FlowSamples sample_flow(const Image<Flow>& dense, const FramePair& pair);

/// A pair's points, with the dense data needed to evaluate them.
struct ExtractedPair {
  FramePair pair;
  std::optional<FlowSamples> true_flow;  ///< if the data set has it
  double decode_ms = 0;                  ///< decoding time of the previous frame
  double extraction_ms = 0;
};

/// Reads a sequence in windows of frames, so that memory is bounded. The pairs do not depend on `jobs`,
/// except for times.
class PairReader {
 public:
  /// Applies the mask models of `noise` to the frames.
  PairReader(const Sequence& sequence, const ExtractionOptions& options, Noise noise, int jobs);

  /// Returns the pairs of the next window, in order; empty at the end. Throws Error on bad files, Interrupted
  /// on Ctrl-C.
  std::vector<ExtractedPair> next();

 private:
  struct Decoded {
    Frame frame;
    std::optional<Image<Flow>> true_flow;
    double decode_ms = 0;
  };

  Decoded decode(int index) const;
  ExtractedPair extract(const Decoded& prev, const Decoded& curr) const;

  const Sequence& sequence_;
  const ExtractionOptions& options_;
  Noise noise_;
  int jobs_;
  int next_;
  std::optional<Decoded> border_;  ///< the last frame of the previous window
};

}  // namespace sextant
