#pragma once

// Choice of the points that a refinement uses (option pipeline.refine_on), between the robust start and the
// estimator:
//
//   inliers      points within the RANSAC threshold of the start. If the noise exceeds the threshold they are
//                few, and selected for agreement with a motion through three noisy points
//   all          every measurement in front of the camera at the start, outliers included
//   reselected   points that agree with the refined motion, given the noise level of the residuals
//                themselves. The RANSAC threshold then only serves to find a start
//
// `reselected` models the residuals e = project(X m) - p - phi within a window of w standard deviations as a
// mixture of a Gaussian core and outliers that are uniform over the window (Torr & Zisserman, MLESAC, CVIU
// 2000; fitted by expectation maximisation),
//
//   p(e) = share N(e; 0, diag(sigma_u^2, sigma_v^2)) + (1 - share) / (pi w^2 sigma_u sigma_v),
//
// and keeps the points that more likely belong to the core. If there are no outliers the gate opens to w
// sigma; if there are many, or the tails are heavy, it closes to about 2.3 sigma. Fit and motion alternate.

#include "sextant/base/names.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/measurement/problem.h"

namespace sextant {

enum class RefineOn { inliers, all, reselected };
constexpr Names<3> names_of(RefineOn) { return {"inliers", "all", "reselected"}; }

/// Returns the starting point of the refinement: a motion and the inliers. `start` is that of robust_start();
/// it is returned unchanged for `inliers`, and for `reselected` if the mixture cannot be fitted.
StartingPoint choose_points(const Problem& problem, const StartingPoint& start, RefineOn refine_on);

}  // namespace sextant
