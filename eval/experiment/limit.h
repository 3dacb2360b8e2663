#pragma once

// The limit beside an error: Cramer-Rao bound and NEES of the bodies of one frame pair, written into their
// records (docs/metrics.md):
//
//   values.nees                         of every estimate that has truth
//   bound.Et_m, ER_deg                  RMS of the camera-frame errors, from flow and previous depth
//   bound.Et_both_m, ER_both_deg        with the current frame's depth too, where it is noisy
//   bound.Et_body_m, ER_body_deg        objects: body frame, previous depth; needs the camera's bound too
//
// A bound is that of the measurements that the estimator was offered - the points left after gates, at their
// values before noise - and of the noise declared for them. It is left out without declared noise and where
// motion_bound() (metrics/crlb.h) has none.

#include <vector>

#include "sextant/eval/experiment/evaluate_pair.h"

namespace sextant {

/// `records` are those of `result`.
void add_limits(const FrameResult& result, const PairContext& context, std::vector<Record>& records);

}  // namespace sextant
