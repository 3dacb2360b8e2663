#pragma once

// Cramer-Rao lower bound (CRLB) of one body's motion over a frame pair (docs/method.md and docs/metrics.md,
// "The Cramér-Rao bound").
//
// The unknowns are X = T_curr_prev and, for each point i, its depth z_i. The measurements are flow and
// depth(s), with independent Gaussian errors of the declared standard deviations (problem.h). Eliminating
// every z_i from the Fisher information of all unknowns (Schur complement) leaves, for the left twist of X,
//
//   I = sum_i J_i^T S_i^-1 J_i,   J_i = d project(exp(xi) X m_i) / d xi
//   S_i = diag(flow^2) + sigma(z_i)^2 j_i j_i^T,   j_i = d project(X m_i) / d z_i
//
// at the true values. Any unbiased estimator has covariance >= I^-1. If the depth of the current frame is a
// measurement too (`both_depths`), the residual has a third row d'_i - z(X m_i). Its variance is
// sigma(z'_i)^2 + (R ray_i)_z^2 sigma(z_i)^2, its covariance with the first two rows (R ray_i)_z sigma(z_i)^2
// j_i.
//
// If errors are correlated over the image (noise.correlation), all points are processed together. With J the
// rows of all J_i,
//
//   I = J^T S^-1 J,   S_ik = rho(|p_i - p_k|) (diag(flow^2) + sigma(z_i) sigma(z_k) j_i j_k^T)
//
// from flow and previous depth. The cost is cubic: bodies of more than 600 points have no bound.
//
// Two effects are neglected. sigma(z) is treated as known and not as information about z (worth 8 (sigma/z)^2
// of the depth's own information). And d' is read at a pixel centre, up to half a pixel from p + phi, so that
// on slanted surfaces it is a biased measurement of z(X m), and estimators do not attain `both_depths`.

#include <optional>

#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {

/// Lower bounds I^-1 on the covariance of the left twist of X (m, rad).
struct MotionBound {
  Matrix6d previous_depth;  ///< from flow and the previous frame's depth
  /// nullopt unless the current frame's depth is a noisy measurement too
  std::optional<Matrix6d> both_depths;
};

/// Returns the bound for the noise-free points `exact`; a finite depth_curr indicates that the current frame
/// has a depth for this point. nullopt if no noise is declared for an axis of the flow; if the errors are
/// not Gaussian (outliers, rounding) or if several points share them; if errors correlated over the image
/// have more than 600 points; and if the points do not determine the motion.
std::optional<MotionBound> motion_bound(const PinholeCamera& camera, const Correspondences& exact,
                                        const SE3& T_curr_prev, const MeasurementNoise& noise);

/// Returns Ad(T) C Ad(T)^T: the covariance of the twist eta with exp(eta) = T exp(xi) T^-1, from that of xi.
///
/// To first order, with Xhat = exp(xi) X, the errors E = Mhat^-1 M of pair_errors.h have these twists, where
/// index 0 denotes the background and L = T_camera_object at the previous frame:
///   camera's motion, M = X^-1                                   xi
///   object, camera frame, M = X                                -Ad(X^-1) xi
///   object, body frame, M = L^-1 X_0^-1 X L                     Ad(L^-1 X^-1) (xi_0 - xi)
Matrix6d transported(const Matrix6d& covariance, const SE3& T);

/// Returns the root mean squares of E_t (m) and E_R (deg): sqrt(trace) of the two diagonal blocks of the
/// covariance of E's twist.
PoseChangeError rms_error(const Matrix6d& covariance);

// ---- normalised estimation error squared (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.4) of a motion
//
//   NEES = e^T C^-1 e,   exp(e) = Xhat X^-1,   C = covariance of the left twist
//
// If the errors are Gaussian and C is correct, the NEES follows a chi-square distribution with 6 degrees of
// freedom. To first order it does not depend on the frame, since e and C are transported together.

inline constexpr int nees_dof = 6;

/// Returns the NEES; nullopt if the covariance is not positive definite or the result is not finite.
std::optional<double> nees(const SE3& estimate, const Matrix6d& covariance, const SE3& truth);

}  // namespace sextant
