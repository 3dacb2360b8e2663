#pragma once

// Optical flow end-point error over points (px): mean of |flow - truth|, and per axis the mean absolute
// error (paper Table II). Points whose flow or truth is not finite are left out and not counted.

#include <span>
#include <vector>

#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/correspondences.h"

namespace sextant {

struct FlowError {
  double epe_px = 0;  ///< NaN when n == 0
  double x_px = 0;
  double y_px = 0;
  int n = 0;
};

FlowError flow_error(std::span<const double> u, std::span<const double> v, std::span<const double> true_u,
                     std::span<const double> true_v);

/// The flow that a rigid motion gives to points of known depth: project(X * backproject(p, d)) - p.
/// Where a data set has true motion but no true flow, this is its `induced` truth: it contains the errors
/// of the measured depth. NaN behind the camera.
struct PointFlow {
  std::vector<double> u;
  std::vector<double> v;
};
PointFlow induced_flow(const PinholeCamera& camera, const SE3& T_curr_prev, const Correspondences& points);

}  // namespace sextant
