#pragma once

// Noise levels of one body from its residuals at a motion X, where nobody declares them (docs/method.md,
// "Flow and depth both uncertain").
//
//   sigma_flow   robust scale of the residual across the epipolar direction, where depth has no part
//   delta_d      from the disparities of the two frames where both are measured, else from the residual along
//                the epipolar direction beyond what sigma_flow explains
//   delta_d_curr robust scale of the current disparity against the prediction, at least delta_d: it also
//                holds what reading the current depth at a whole pixel costs on slanted surfaces
//
// Robust scale: 1.4826 times the median of the absolute values within three times the scale, iterated, so
// that wrong flows do not count. The iteration begins with the scale of the starting motion's inliers: where
// most flows are wrong, the scale of all would be theirs. At the starting motion itself nothing is known of
// the other points; there levels are those of the inliers alone.

#include <vector>

#include "sextant/estimator/flow_depth/flow_depth_solver.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Points of one body to estimate levels from.
struct LevelSample {
  RoughFlowDepthData all;      ///< that count
  RoughFlowDepthData inliers;  ///< of the start; all if it has none

  LevelSample(const RoughFlowDepthData& data, const StartingPoint& start);
};
enum class LevelsOf { inliers, all };

/// Scale of a Gaussian from absolute values with gross errors among them; 0 for no values. `likely`: some
/// without, to begin with.
double robust_scale(std::vector<float> absolute, std::vector<float> likely);

/// Fills in the levels that are 0.
NoiseLevels estimate_noise_levels(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev,
                                  const NoiseLevels& declared);

/// The whole reprojection error taken as flow noise, one level for both axes; the depth as exact.
NoiseLevels estimate_reprojection_level(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev);

/// Standard deviation of the current disparity (px) at X.
double estimate_delta_d_curr(LevelSample& sample, const SE3& T_curr_prev, const NoiseLevels& levels);

// Inverse depth is an affine function of the pixel on every plane. Where the points around one agree with a
// plane within the noise of their depths, its slopes tell how inverse depth changes within a pixel.
//
// Neighbourhood: a square of about `radius_px` around, nine cells of a grid; the points of the middle one
// share it. It has relief where its residuals fail the chi-square test against kappa (1/m) at 99 %.

struct LocalPlane {
  bool fitted = false;  ///< false: too few points, or all in a row
  double slope_u = 0;   ///< d inverse depth / d u, 1/(m px)
  double slope_v = 0;
  double relief = 0;  ///< variance about the plane beyond that of kappa, 1/m^2; 0 = none
};

std::vector<LocalPlane> fit_local_planes(const Correspondences& points, double kappa, double radius_px);

}  // namespace sextant
