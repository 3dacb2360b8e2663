#pragma once

// Degenerate problems, and the covariance of all other problems. kappa (1/m) is the standard deviation of an
// inverse depth: as declared by the problem, otherwise for a disparity accuracy of 0.2 px (0 without stereo).
//
//   too_few_points  fewer than three measurements: six unknowns, two equations per point
//   at_infinity     no inverse depth exceeds three kappa: the translation is unobservable
//   collinear       the pixels lie on a line (within 0.5 px RMS) along which inverse depth is affine (within
//                   2 kappa RMS), as on every line in space; or all pixels coincide: the rotation about that
//                   line is unobservable
//   no_parallax     the covariance shows a weakly observable direction: a rotation with a standard deviation
//                   above 0.25 rad, or a translation of the points' centre with one above half the distance
//                   of the centre; or the Hessian is singular to rounding. Rotation and translation are then
//                   ambiguous, as for a small flat patch
//
// A stationary camera or body is not degenerate: depth is measured and need not be inferred from motion.

#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Returns ok, too_few_points, at_infinity or collinear for the points in `keep` (empty: all).
Status check_geometry(const Problem& problem, const std::vector<unsigned char>& keep);

/// First step of every estimator: returns an estimate with the measured flow, the valid measurements among
/// `keep` (empty: all) as inliers, and the status of check_geometry().
MotionEstimate begin_estimate(const Problem& problem, const std::vector<unsigned char>& keep);

/// Copies motion, cost and iterations of a solver and returns true; returns false, without copying, if the
/// motion or the cost is not finite. The status becomes diverged in both cases, until conclude() replaces it.
bool take_solution(const SolverResult& solution, MotionEstimate& estimate);

/// Last step of every estimator: computes the covariance of the left twist, `variance_factor` times the
/// inverse Hessian, for the motion and the inliers in `estimate`. Sets covariance and condition, unless the
/// Hessian is singular, and the status: ok, or the reason why the motion is not determined.
void conclude(const Problem& problem, const Matrix6d& hessian, double variance_factor,
              MotionEstimate& estimate);
/// Overload for a given covariance.
void conclude(const Problem& problem, const Matrix6d& covariance, MotionEstimate& estimate);
/// Replaces the covariance of the motion, and its condition. If the new covariance does not determine the
/// motion, only the status changes, from ok to no_parallax.
void replace_covariance(const Matrix6d& covariance, MotionEstimate& estimate);

}  // namespace sextant
