#pragma once

// Graduated non-convexity (Blake & Zisserman 1987; Yang et al., RA-L 2020) on all points from a robust start:
// Geman-McClure from 8 to 1.5 sigma in 6 steps, from nearly convex to redescending. The wide kernels at the
// beginning can be drawn to where most points are wrong together, so a descent straight from the start
// competes: the lower cost under the last kernel wins. A sample of the points is enough to find the way.

#include "sextant/estimator/flow_depth/flow_depth_solver.h"
#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

inline constexpr double last_graduated_scale = 1.5;  // sigmas

SE3 graduate(const RoughFlowDepthData& all, const SE3& start, const NoiseLevels& levels);

/// Factor by which a robust kernel's estimate varies more than the inverse of sum J^T S^-1 J says:
/// n sum(|psi|^2 / d) / (sum(div psi / d))^2 over the points in use, at the q last evaluated,
/// psi = weight(q) r (Huber 1981, ch. 6).
template <typename Real>
double variance_factor(const FlowDepthPoints<Real>& data, const RobustKernel& kernel);

/// The option robust = geman_mcclure_gnc of motion_only and joint_flow: graduation on all points of the
/// reprojection error, whose scale is estimated from the residuals; inliers = points within three times that
/// scale. Fills in everything but the refined flow.
MotionEstimate estimate_graduated(const Problem& problem, const StartingPoint& start,
                                  const SolverOptions& options);

}  // namespace sextant
