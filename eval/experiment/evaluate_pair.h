#pragma once

// Joins what an estimator says about one frame pair with ground truth: FrameResult + truth -> records, ego
// first, then objects by id. A pure function; docs/metrics.md defines every key it writes.
//
// Objects: every instance of the result and every true object that has a pose in both frames. True object
// ids equal instance ids. Status: estimated but no truth in both frames -> no_truth; truth in both frames but
// no instance -> not_detected; all others come from the estimator.
//
// EPE is taken over the estimator's inliers. True flow is `given` where the data set has it dense, else
// `induced` by the true motion and the measured depth (and then contains that depth's error).

#include <vector>

#include "sextant/estimator/pipeline.h"
#include "sextant/eval/experiment/pair_reader.h"
#include "sextant/eval/records/record.h"
#include "sextant/measurement/problem.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct PairContext {
  std::string dataset;
  std::string sequence;
  std::string estimator;
  PinholeCamera camera;
  const SequenceTruth& truth;
  /// T_world_camera accumulated by the estimate, starting at the true pose of the first frame. Frames
  /// without an estimated pose, or a sequence without a true first pose, have none here.
  const Trajectory& estimated;
  const FlowSamples* true_flow = nullptr;  ///< at the points' pixels, previous to current frame; may be null
  std::string noise = "none";
  double level = 0;
  uint64_t seed = 0;
  const FramePair* clean = nullptr;  ///< the pair before noise; null: none was added, there is no bound
};

std::vector<Record> evaluate_pair(const FrameResult& result, const PairContext& context);

// ---- limit: the limit beside an error: Cramer-Rao bound and NEES of the bodies of one frame pair, written
// into their records (docs/metrics.md):
//
//   values.nees                         of every estimate that has truth
//   bound.Et_m, ER_deg                  RMS of the camera-frame errors, from flow and previous depth
//   bound.Et_both_m, ER_both_deg        with the current frame's depth too, where it is noisy
//   bound.Et_body_m, ER_body_deg        objects: body frame, previous depth; needs the camera's bound too
//
// A bound is that of the measurements that the estimator was offered - the points left after gates, at their
// values before noise - and of the noise declared for them. It is left out without declared noise and where
// motion_bound() (metrics/crlb.h) has none.

/// `records` are those of `result`.
void add_limits(const FrameResult& result, const PairContext& context, std::vector<Record>& records);

}  // namespace sextant
