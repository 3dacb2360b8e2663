#pragma once

// Compares the results for one frame pair with ground truth: FrameResult + truth -> records, ego first, then
// objects by id. A pure function; docs/metrics.md defines every key.
//
// Objects are all instances of the result and all true objects with a pose in both frames. True object ids
// equal instance ids. Status: estimated but without truth in both frames -> no_truth; truth in both frames
// but no instance -> not_detected; all others come from the estimator.
//
// The EPE of the measured flow is taken over all points of a body, the EPE before and after refinement over
// the estimator's inliers. True flow is `given` if the data set has dense flow, otherwise `induced` by the
// true motion and the measured depth (and then contains the error of that depth).

#include <vector>

#include "sextant/estimator/pipeline.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/records/record.h"
#include "sextant/measurement/problem.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct PairContext {
  Record identity;  ///< data set, sequence, estimator, noise, level and seed of the records
  PinholeCamera camera;
  const SequenceTruth& truth;
  /// T_world_camera accumulated from the estimate, starting at the true pose of the first frame. Frames
  /// without an estimated pose are missing; it is empty if the sequence has no true first pose.
  const Trajectory& estimated;
  const FlowSamples* true_flow = nullptr;  ///< at the points' pixels, previous to current frame; may be null
  /// the pair before noise; null: no noise was added, and there is no bound
  const FramePair* clean = nullptr;
};

// ---- CRLB and NEES of the bodies of one frame pair, stored in their records (docs/metrics.md):
//
//   values.nees                         of every estimate with truth and a positive definite covariance
//   bound.Et_m, ER_deg                  RMS of the camera-frame errors, from flow and previous depth
//   bound.Et_both_m, ER_both_deg        with the current frame's depth too, if it is noisy
//   bound.Et_body_m, ER_body_deg        objects: body frame, previous depth; needs the camera's bound too
//
// A bound is computed from the measurements passed to the estimator (the points left after the gates, at
// their values before noise) and from the noise declared for them. It is left out without declared noise and
// if motion_bound() (metrics/crlb.h) returns nullopt.

std::vector<Record> evaluate_pair(const FrameResult& result, const PairContext& context);

}  // namespace sextant
