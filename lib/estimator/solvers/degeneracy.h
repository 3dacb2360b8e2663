#pragma once

// What cannot be estimated, and how sure the rest is. With kappa (1/m) the standard deviation of an inverse
// depth, declared by the problem, else that of a stereo camera with a disparity of 0.2 px:
//
//   too_few_points  fewer than three measurements: six unknowns, two equations a point
//   at_infinity     no inverse depth differs from zero by three kappa: a translation cannot be seen
//   collinear       the pixels lie on a line (within 0.5 px RMS) and along it inverse depth is affine (within
//                   2 kappa RMS), as it is on every line in space; or all pixels are one: a turn about that
//                   line cannot be seen
//   no_parallax     the covariance leaves a direction open: a turn of more than 0.25 rad standard deviation,
//                   or a translation of the points' centre of more than half its distance. Turns and
//                   translations look the same, as for a small flat patch.
//
// A camera or body that stands still is none of these: depth is measured, so motion need not reveal it.

#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// ok, too_few_points, at_infinity or collinear: what `keep`'s points (empty: all) can determine.
Status check_geometry(const Problem& problem, const std::vector<unsigned char>& keep);

/// The first step of every estimator: the measured flow, the measurements among `keep` (empty: all) as
/// inliers, and the status of check_geometry.
MotionEstimate begin_estimate(const Problem& problem, const std::vector<unsigned char>& keep);

/// Motion, cost and iterations of a solver. Returns false, with status diverged, unless they are finite.
bool take_solution(const SolverResult& solution, MotionEstimate& estimate);

/// The last step of every estimator: enters the covariance of the left twist, given the motion and its
/// inliers. Fills covariance, condition and status: ok, else the reason why the motion is open.
void conclude(const Problem& problem, const Matrix6d& hessian, double variance_factor,
              MotionEstimate& estimate);
/// The same from the covariance itself.
void conclude(const Problem& problem, const Matrix6d& covariance, MotionEstimate& estimate);
/// Another covariance of the same motion, and its condition. Where it leaves the motion open, only the status
/// changes, from ok to no_parallax.
void replace_covariance(const Matrix6d& covariance, MotionEstimate& estimate);

}  // namespace sextant
