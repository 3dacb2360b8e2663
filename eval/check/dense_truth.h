#pragma once

// How good a source's own flow and depth are, where its data set has the truth of every pixel
// (metrics/dense_errors.h): of networks, DIS and SGBM, before an estimator sees them.

#include <optional>
#include <string>

#include "sextant/datasets/dataset.h"
#include "sextant/metrics/dense_errors.h"

namespace sextant {

struct DenseTruthErrors {
  std::optional<DenseFlowError> flow;            ///< empty: no flow, or no truth of it
  std::optional<DenseDisparityError> disparity;  ///< empty: no depth, or no truth of it
  int n_flow_frames = 0;                         ///< frames with both
  int n_depth_frames = 0;

  /// "EPE 0.95 px (0.82 along x, 0.30 along y), outliers 6.57 %, of 107 thousand pixels in 1 frame; ..."
  std::string flow_text() const;
  std::string disparity_text() const;
};

/// Over all frames, `jobs` at a time; of channels that are the truth itself (SequenceInfo::exact) nothing.
/// Throws Error as read() does.
DenseTruthErrors dense_truth_errors(const Sequence& sequence, int jobs);

}  // namespace sextant
