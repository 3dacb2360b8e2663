#pragma once

// Robust start: AP3P (p3p.h) inside RANSAC (Fischler & Bolles) against the propagated motion; the model with
// more inliers wins, the propagated one on a tie (paper sec. IV-B). Samples come from a counter-based
// sequence of the sample's index: no state, no clock, no thread.

#include <optional>

#include "sextant/base/options.h"
#include "sextant/estimator/solvers/motion_estimate.h"
#include "sextant/measurement/problem.h"

namespace sextant {

struct RobustStartOptions {
  SEXTANT_OPTIONS(
      (double, inlier_threshold_px, 1.0, "px",
       "largest reprojection error of an inlier of a sample; finds the start, while refine_on says which points are refined on"),
      (double, confidence, 0.999, "probability", "of one all-inlier sample; sets the number of samples"),
      (int, max_iterations, 500, "count", "most samples drawn"),
      (int, min_iterations, 20, "count", "fewest samples drawn"),
      (int, local_refinements, 2, "count",
       "least-squares steps on the winner's inliers, each kept only if it gains inliers"))
  void check() const;
};

struct RobustStart {
  Status status = Status::too_few_points;  ///< ok, too_few_points, collinear or at_infinity
  StartingPoint start;
  int n_inliers = 0;
  int iterations = 0;
  bool propagated = false;  ///< the propagated motion won
};

/// Needs at least 4 points. `propagated` is the motion predicted from the past, if there is one.
RobustStart robust_start(const Problem& problem, const std::optional<SE3>& propagated,
                         const RobustStartOptions& options);

}  // namespace sextant
