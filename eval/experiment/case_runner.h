#pragma once

// Runs one case: the pairs of one source, in order, with one noise level and seed, through one estimator, and
// compares the results with ground truth.
//
//   source -> pair -> noise -> estimator -> records;   poses and object motions are accumulated on the way

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/case_motions.h"
#include "sextant/eval/records/record.h"
#include "sextant/measurement/problem.h"
#include "sextant/noise/noise.h"
#include "sextant/truth/truth.h"

namespace sextant {

// ---- The frame pairs of a source, reduced to points. Every frame is decoded once; only the dense data
// needed for the pairs' points are kept: an estimator uses a few thousand correspondences, not images.

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

// ---- Cases

struct CaseSettings {
  std::string estimator_label;  ///< label in records
  std::shared_ptr<const CaseEstimator> estimator;
  PipelineOptions pipeline;
  Noise noise;       ///< the mask models are already applied to the pairs, since they precede extraction
  double level = 0;  ///< level in records
  uint64_t seed = 0;
  std::filesystem::path folder;  ///< CaseContext::folder
  bool rescore = false;          ///< CaseContext::rescore
};

struct CaseOutcome {
  /// Ordered by pair; for each result of the estimator in turn: ego first, then objects by id.
  std::vector<Record> records;
  CaseMotions motions;                ///< motions of the first result, if there are several
  NoiseVerification noise;            ///< achieved on the points
  std::vector<std::string> problems;  ///< PairEstimator::problems() and diagnose_case()
};

/// Returns the next pairs, in order, valid until the next call; empty at the end.
using NextPairs = std::function<std::span<const ExtractedPair>()>;

/// Called after each pair, in order, with the first result of the estimator and the records of all results.
using PairObserver = std::function<void(const FrameResult&, std::span<const Record>)>;

/// Runs cases that share their pairs: each case processes the pairs in order; `jobs` cases run at a time.
/// Only the description and truth of `sequence` are used here, but an estimator of a kind (case_estimator.h)
/// may read its frames. `on_pair` (may be empty) observes the first case. Throws Interrupted on Ctrl-C.
std::vector<CaseOutcome> run_cases(const Sequence& sequence, const std::vector<CaseSettings>& cases,
                                   const NextPairs& next, int jobs, const PairObserver& on_pair = {});

}  // namespace sextant
