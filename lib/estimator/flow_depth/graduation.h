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
/// S^-1 J, at the last evaluated q. With psi = weight(q) r, d = 2 residuals of a point (3 with a current
/// depth), s = div psi / d, and M = sum(d) residuals of the included points,
///
///     K^2 M / (M - 6) * mean(|psi|^2 / d) / mean(s)^2,   K = 1 + 6 / M * var(s) / mean(s)^2.
///
/// The last quotient is exact for many points. The factors before it correct for the 6 parameters, which fit
/// few points more closely than their noise (Huber 1981, section 7.6); with M <= 6 they are left out.
/// Infinite if mean(s) is not positive.
template <typename Real>
double variance_factor(const FlowDepthPoints<Real>& data, const RobustKernel& kernel);

/// Option robust = geman_mcclure_gnc of motion_only and joint_flow: graduation on the reprojection error of
/// all points, with a scale that is estimated from the residuals; inliers are the points within three times
/// that scale. Fills in everything except the refined flow.
MotionEstimate estimate_graduated(const Problem& problem, const StartingPoint& start,
                                  const SolverOptions& options);

}  // namespace sextant
