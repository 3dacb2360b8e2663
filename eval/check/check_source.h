#pragma once

// Checks everything that a source provides before a run relies on it. Checks that every file exists, decodes
// every frame, and reports for each channel the number of frames that have it, its size, the share of valid
// pixels and the range of values. Then checks that the parts are consistent with each other (conventions.h),
// reports the likely cause if they are not, and compares flow and depth that are not ground truth with the
// ground truth.
//
// The convention checks use all of up to 24 frames, and for longer sources 6 runs of 4 successive frames,
// evenly distributed: their duration does not grow with the length. Checks that need only true poses and
// objects, or the outlines of the masks, use every decoded frame.

#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/eval/check/conventions.h"
#include "sextant/metrics/dense_errors.h"

namespace sextant {

/// One line of the report. Numbers that do not apply are nullopt.
struct SourceCheck {
  std::string
      name;  ///< "files", "gray", "depth", "flow", "mask", "poses", "objects", "static flow", ..., "note"
  /// true for a check of conventions.h: has value, limit and n, or a message why it was not possible
  bool convention = false;
  CheckOutcome outcome = CheckOutcome::pass;
  std::optional<int> n_present;  ///< number of frames (channels, poses) or tracks (objects)
  std::optional<int> n_expected;
  std::string size_px;                     ///< such as "1242x375"
  std::optional<double> valid_share;       ///< 0..1, over all pixels of all frames
  std::optional<double> min, median, max;  ///< range of valid values; the median is over every 16th of them
  std::optional<double> value, limit;      ///< result of a convention check, which passes up to the limit
  std::optional<int> n;                    ///< number of samples behind the value
  std::string counted;                     ///< unit of n: "points"
  std::string unit;                        ///< unit of the range, or of value and limit
  std::string message;                     ///< problem, or other information
  std::string cause;  ///< likely cause, or "no known cause fits"; empty if the check passes
};

struct CheckSourceOptions {
  int jobs = 1;
  bool quiet = false;  ///< no progress line
  bool quick = false;  ///< decodes only the frames that the convention checks use; no dense errors
};

/// Runs all checks. Bad frames are reported as FAIL; an Error is thrown only if the check cannot continue.
std::vector<SourceCheck> check_source(const Sequence& sequence, const CheckSourceOptions& options);

// ---- Dense ground truth (dense_truth.cc): the accuracy of flow and depth of a source, as computed by
// networks, DIS or SGBM, before an estimator uses them. The data set must have dense ground truth
// (metrics/dense_errors.h).

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
