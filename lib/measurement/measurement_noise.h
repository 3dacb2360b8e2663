#pragma once

// What is declared about the errors of one body's measurements, as the data sheet of a sensor: standard
// deviations, never the errors themselves. 0 = nothing declared for that channel.
//
//   flow    N(0, diag(flow_x_px^2, flow_y_px^2))
//   depth   of both frames: N(0, sigma^2), sigma(z) = z^2 * inverse_depth_per_m: a disparity of accuracy
//           delta_d (px) has delta_d / (f b)

#include "sextant/measurement/spatial_correlation.h"

namespace sextant {

struct MeasurementNoise {
  double flow_x_px = 0;
  double flow_y_px = 0;
  double inverse_depth_per_m = 0;  ///< 1/m
  double flow_outlier_share = 0;   ///< 0..1, of flows that are wrong beyond the deviations above
  SpatialCorrelation correlation;  ///< of each channel's errors between points
  /// The errors are independent between points and Gaussian: no outliers, no rounding, no common draw.
  bool independent_gaussian = true;

  double depth_sigma_m(double depth_m) const { return depth_m * depth_m * inverse_depth_per_m; }
  bool operator==(const MeasurementNoise&) const = default;
};

}  // namespace sextant
