#pragma once

// Consistency of estimates, without ground truth.
//
// Split-half consistency of a covariance, which needs no ground truth. The body is estimated from each of two
// disjoint halves of its inliers, X_1 and X_2, and
//
//   split NEES = e^T (C_1 + C_2 - C_12 - C_21)^-1 e,   exp(e) = X_1 X_2^-1,
//
// has a mean of 6 if the covariances are correct. A larger mean indicates errors that the covariance does not
// contain. C_12 is the cross-covariance of the halves from errors that correlate over the image
// (error_model.h); it is 0 for estimators without an error model. Halves with an error model use the noise
// levels and error variances that were estimated from the whole body, because its covariance is under test.
// Only inliers of the whole body take part; estimators that choose their points gate each half once more.

#include <optional>

#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

struct SplitNees {
  std::optional<double> sides;  ///< halves left and right of the median column of the inliers
  std::optional<double> cells;  ///< halves of black and white squares of a chess board, 80 px wide
};

/// Returns the NEES of each split; nullopt if a half has no estimate or the covariance of the difference is
/// not positive definite. Each half starts from the motion and the inliers of the whole body.
SplitNees split_nees(const Problem& problem, const MotionEstimate& whole, const Estimator& estimator);

// Expansion of the flow against the change of the disparities. Both measure how far an object moves along the
// viewing ray, and errors that are smooth over the object do not show in the residuals of either. X_f is the
// motion estimated from flow and previous depth only, z_i the depth of X_f m_i, z'_i the measured current
// depth, d the median disparity, s the RMS distance of the points from their centroid in px:
//
//   y = median of z_i / z'_i - 1,   gap = -y median z_i
//   chi2 = y^2 / (g^T C_f g + (common_flow_px / s)^2 + (common_disparity_px / d)^2)
//
// g = d ln(z) / d xi at the centroid, C_f the covariance of X_f. The mean of chi2 is 1 if flow and
// disparities have no larger common errors than these; far above 1, one of the two has, for example because a
// network draws the flow of a far car towards that of the background.

/// Standard deviations of errors common to all points of a body, as static bodies of real frames show them
/// with the flow of PWC-Net and DIS and the disparities of SGBM (scripts/maintain/real_frames.py).
inline constexpr double common_flow_px = 0.12;
inline constexpr double common_disparity_px = 0.16;  ///< error of the change between two frames

struct ExpansionGap {
  double gap_m = 0;  ///< depth by which the disparities put the body farther away than the flow does
  double chi2 = 0;
};

/// Returns the gap of the inliers of `whole` that have a current depth; nullopt with fewer than 10 of them,
/// or if they give no motion without current depths.
std::optional<ExpansionGap> expansion_gap(const Problem& problem, const MotionEstimate& whole,
                                          const Estimator& estimator);

}  // namespace sextant
