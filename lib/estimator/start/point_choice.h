#pragma once

// Which points a refinement uses (option pipeline.refine_on),
// chosen between the robust start and the estimator:
//
//   inliers      those within the RANSAC threshold of the start. Where the noise exceeds the threshold these
//                are few, and chosen for agreeing with a motion through three noisy points
//   all          every measurement in front of the camera at the start, wrong flows included
//   reselected   those that agree with the refined motion, by the noise that the residuals themselves show.
//                The RANSAC threshold then only serves to find a start
//
// `reselected` takes the residuals e = project(X m) - p - phi within a window of w standard deviations as a
// mixture: a Gaussian core, and wrong flows that are spread evenly over the window (Torr & Zisserman, MLESAC,
// CVIU 2000; fitted by expectation maximisation),
//
//   p(e) = share N(e; 0, diag(sigma_u^2, sigma_v^2)) + (1 - share) / (pi w^2 sigma_u sigma_v),
//
// and keeps the points that more likely belong to the core. Where all flows are good the gate opens to w
// sigma; where many are wrong, or tails are heavy, it closes to about 2.3 sigma. Fit and motion alternate.

#include "sextant/base/names.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/measurement/problem.h"

namespace sextant {

enum class RefineOn { inliers, all, reselected };
constexpr Names<3> names_of(RefineOn) { return {"inliers", "all", "reselected"}; }

/// What the refinement starts from: a motion, and the points that count. `start` is that of robust_start().
StartingPoint choose_points(const Problem& problem, const StartingPoint& start, RefineOn refine_on);

}  // namespace sextant
