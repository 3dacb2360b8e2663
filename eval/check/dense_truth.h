#pragma once

// Accuracy of flow and depth of a source, as computed by networks, DIS or SGBM, before an estimator uses
// them. The data set must have dense ground truth (metrics/dense_errors.h).

#include <optional>
#include <string>

#include "sextant/datasets/dataset.h"
#include "sextant/metrics/dense_errors.h"

namespace sextant {

struct DenseTruthErrors {
  std::optional<DenseFlowError> flow;            ///< nullopt: no flow, or no true flow
  std::optional<DenseDisparityError> disparity;  ///< nullopt: no depth, or no true depth
  int n_flow_frames = 0;                         ///< number of frames with both
  int n_depth_frames = 0;

  /// Return texts such as "EPE 0.95 px (0.82 along x, 0.30 along y), outliers 6.57 %, over 107000 pixels of 1
  /// frame, 95.2 % of those with truth"; empty without errors.
  std::string flow_text() const;
  std::string disparity_text() const;
};

/// Measures the errors over all frames, `jobs` at a time; channels that are the ground truth
/// (SequenceInfo::exact) are left out. Throws Error like Sequence::read().
DenseTruthErrors dense_truth_errors(const Sequence& sequence, int jobs);

}  // namespace sextant
