#pragma once

// Noise levels of one body from its residuals at a motion X, where nobody declares them. METHOD section 2.
//
//   sigma_flow   robust scale of the residual across the epipolar direction, where depth has no part
//   delta_d      from the disparities of the two frames where both are measured, else from the residual along
//                the epipolar direction beyond what sigma_flow explains
//   delta_d_curr robust scale of the current disparity against the prediction, at least delta_d: it also
//                holds what reading the current depth at a whole pixel costs on slanted surfaces
//
// Robust scale: 1.4826 times the median of the absolute values within three times the scale, iterated, so
// that wrong flows do not count.

#include "sextant/estimator/flow_depth_solver.h"

namespace sextant {

/// So many points tell a scale to 3 %.
inline constexpr size_t level_sample = 1500;

/// Scale of a Gaussian from absolute values with gross errors among them; 0 for no values.
double robust_scale(std::vector<float> absolute);

/// Fills in the levels that are 0. `data` tells which points count.
NoiseLevels estimate_noise_levels(RoughFlowDepthData& data, const SE3& T_curr_prev,
                                  const NoiseLevels& declared);

/// The whole reprojection error taken as flow noise, one level for both axes; the depth as exact.
NoiseLevels estimate_reprojection_level(RoughFlowDepthData& data, const SE3& T_curr_prev);

/// Standard deviation of the current disparity (px) at X.
double estimate_delta_d_curr(RoughFlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels);

}  // namespace sextant
