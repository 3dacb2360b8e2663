#pragma once

// Graduated non-convexity (Blake & Zisserman 1987; Yang et al., RA-L 2020) on all points from a robust start:
// Geman-McClure with scales from 8 to 1.5 sigma in 6 steps, from nearly convex to redescending. The wide
// initial kernels can be attracted by a group of consistent outliers; a descent directly from the start
// therefore competes, and the lower cost under the last kernel wins. Both use a sample of at most 2000
// points.

#include "sextant/estimator/flow_depth/flow_depth_solver.h"
#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

inline constexpr double last_graduated_scale = 1.5;  // in sigmas

/// Returns the motion after graduation on the included points, which are not changed.
SE3 graduate(const RoughFlowDepthData& all, const SE3& start, const NoiseLevels& levels);

/// Returns the factor by which the covariance of a robust kernel's estimate exceeds the inverse of sum J^T
/// S^-1 J: n sum(|psi|^2 / d) / (sum(div psi / d))^2 over the n included points, at the last evaluated q,
/// with psi = weight(q) r and d = 2, or 3 with a current depth (Huber 1981, ch. 6). Infinite if the sum of
/// div psi is not positive.
template <typename Real>
double variance_factor(const FlowDepthPoints<Real>& data, const RobustKernel& kernel);

/// Option robust = geman_mcclure_gnc of motion_only and joint_flow: graduation on the reprojection error of
/// all points, with a scale that is estimated from the residuals; inliers are the points within three times
/// that scale. Fills in everything except the refined flow.
MotionEstimate estimate_graduated(const Problem& problem, const StartingPoint& start,
                                  const SolverOptions& options);

}  // namespace sextant
