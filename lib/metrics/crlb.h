#pragma once

// The Cramér-Rao bound of one body's motion over a frame pair (docs/method.md and
// docs/metrics.md, "The Cramér-Rao bound").
//
// Unknown are X = T_curr_prev and, per point i, its depth z_i; measured are flow and depth(s), with
// independent Gaussian errors of the declared deviations (problem.h). Eliminating z_i from the
// Fisher information of all unknowns (Schur complement) leaves, for the left twist of X,
//
//   I = sum_i J_i^T S_i^-1 J_i,   J_i = d project(exp(xi) X m_i) / d xi
//   S_i = diag(flow^2) + sigma(z_i)^2 j_i j_i^T,   j_i = d project(X m_i) / d z_i
//
// at the truth. Any unbiased estimator has covariance >= I^-1. With the depth of the current frame too
// (`both_depths`) the residual has a third row d'_i - z(X m_i); its variance is sigma(z'_i)^2 + (R ray_i)_z^2
// sigma(z_i)^2, its covariance with the others (R ray_i)_z sigma(z_i)^2 j_i.
//
// Where errors correlate over the image (noise.correlation), all points are taken at once: with J the rows of
// all J_i,
//
//   I = J^T S^-1 J,   S_ik = rho(|p_i - p_k|) (diag(flow^2) + sigma(z_i) sigma(z_k) j_i j_k^T)
//
// from flow and previous depth. Its cost is cubic: bodies of more than 600 points have none.
//
// What is known and not in it: sigma(z) is taken as a known number, not as a second message about z (worth
// 8 (sigma/z)^2 of the depth's own information); d' is read at a pixel centre, up to half a pixel beside
// p + phi, so on slanted surfaces it is no unbiased measurement of z(X m) and `both_depths` is out of reach.

#include <optional>

#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {

/// Covariances of the left twist of X: I^-1.
struct MotionBound {
  Matrix6d previous_depth;              ///< from flow and the previous frame's depth
  std::optional<Matrix6d> both_depths;  ///< where the current frame's depth is a noisy measurement too
};

/// `exact`: the points without their noise; a finite depth_curr says that there is a current depth.
/// None where there is no finite bound: flow or errors not declared Gaussian, one draw for all points, or
/// points that do not determine the motion.
std::optional<MotionBound> motion_bound(const PinholeCamera& camera, const Correspondences& exact,
                                        const SE3& T_curr_prev, const MeasurementNoise& noise);

/// Ad(T) C Ad(T)^T: covariance of the twist eta, exp(eta) = T exp(xi) T^-1, from that of xi.
///
/// To first order the errors E = Mhat^-1 M of pair_errors.h have, with Xhat = exp(xi) X, the twists
///   camera's motion, M = X^-1                                   xi
///   object, camera frame, M = X                                -Ad(X^-1) xi
///   object, body frame, M = L^-1 X_0^-1 X L                     Ad(L^-1 X^-1) (xi_0 - xi)
Matrix6d transported(const Matrix6d& covariance, const SE3& T);

/// Root mean square of E_t and E_R: sqrt(trace) of the two diagonal blocks of the covariance of E's twist.
PoseChangeError rms_error(const Matrix6d& covariance);

// ---- normalised estimation error squared (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.4) of a motion:
//
//   NEES = e^T C^-1 e,   exp(e) = Xhat X^-1,   C = covariance of the left twist
//
// If the errors are Gaussian and C is right it is chi-square distributed with 6 degrees of freedom. To first
// order it is the same in every frame: e and C are transported together.

inline constexpr int nees_dof = 6;

/// None where the covariance is not positive definite.
std::optional<double> nees(const SE3& estimate, const Matrix6d& covariance, const SE3& truth);

}  // namespace sextant
