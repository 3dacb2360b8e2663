#pragma once

// Noise levels of one body, estimated from its residuals at a motion X if they are not declared
// (docs/method.md).
//
//   sigma_flow   robust scale of the residual across the epipolar direction, which does not depend on depth
//   delta_d      from the disparities of both frames if more than half of the points have both, otherwise
//                from the variance of the residual along the epipolar direction in excess of sigma_flow
//   delta_d_curr robust scale of the current disparity against the prediction, without the share of delta_d;
//                at least delta_d. Includes the error of reading the current depth at a whole pixel on
//                slanted surfaces
//
// sigma_flow is at least 0.0003 px and delta_d at least 0.01 px. Robust scale: the median of the absolute
// values within three times the scale, over 0.6728 (its value for a standard normal), iterated, so that
// outliers have no influence. The iteration starts with the scale of the starting motion's inliers, because
// the scale of all points would be that of the outliers if they are in the majority. At the starting motion
// itself only the inliers are used.

#include <cstdint>
#include <vector>

#include "sextant/estimator/flow_depth/flow_depth_solver.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Points of one body for the estimation of noise levels.
struct LevelSample {
  RoughFlowDepthData all;      ///< sample of the included points, at most 2000
  RoughFlowDepthData inliers;  ///< sample of the inliers of the start; of all points if there is no inlier

  LevelSample(const RoughFlowDepthData& data, const StartingPoint& start);
};
enum class LevelsOf { inliers, all };

/// Returns the scale of a Gaussian from absolute values with outliers; 0 for an empty list. `likely`: values
/// without outliers, from which the iteration starts.
double robust_scale(std::vector<float> absolute, std::vector<float> likely);

/// Returns `declared` with each level of the flow and of delta_d_px that is 0 replaced by its estimate at
/// T_curr_prev.
NoiseLevels estimate_noise_levels(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev,
                                  const NoiseLevels& declared);

/// Returns the levels that explain the whole reprojection error by flow noise, equal on both axes, with exact
/// depth.
NoiseLevels estimate_reprojection_level(LevelSample& sample, LevelsOf which, const SE3& T_curr_prev);

/// Returns the standard deviation of the current disparity (px), from its difference to the prediction at
/// T_curr_prev after subtraction of levels.delta_d_px^2; at least levels.delta_d_px.
double estimate_delta_d_curr(LevelSample& sample, const SE3& T_curr_prev, const NoiseLevels& levels);

// Local planes. Inverse depth is an affine function of the pixel on every plane. If the points around a pixel
// agree with a plane within the noise of their depths, its slopes give the change of inverse depth within the
// pixel.
//
// Neighbourhood: a square with a half side of about `radius_px`, i.e. nine cells of a grid; the points of the
// middle cell share it. It has relief if its residuals fail the chi-square test against kappa (1/m) at 99 %.

struct LocalPlane {
  bool fitted = false;  ///< false: too few points, or all on a line
  double slope_u = 0;   ///< d inverse depth / d u, 1/(m px)
  double slope_v = 0;
  double relief = 0;  ///< variance about the plane in excess of kappa^2, 1/m^2; 0 = none
};

/// One plane for each point. `kappa`: standard deviation of the inverse depths.
class LocalPlanes {
 public:
  LocalPlanes(const Correspondences& points, double kappa, double radius_px);
  const LocalPlane& operator[](size_t i) const { return planes_[of_point_[i]]; }

 private:
  std::vector<uint32_t> of_point_;
  std::vector<LocalPlane> planes_;  ///< by cell of the grid; 0: of points without a valid measurement
};

}  // namespace sextant
