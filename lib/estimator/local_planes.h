#pragma once

// Inverse depth is an affine function of the pixel on every plane. Where the points around one agree with a
// plane within the noise of their depths, the plane's value replaces the measured inverse depth: that takes
// most of the noise out of the regressor, and with it the errors-in-variables effect (docs/method.md).
//
// Neighbourhood: the points within `radius_px` in u and in v. A plane is accepted by the chi-square test of
// its residuals against kappa (1/m) at 99 %.

#include <vector>

#include "sextant/measurement/correspondences.h"

namespace sextant {

struct LocalPlane {
  bool tested = false;        ///< there were enough neighbours to accept or reject a plane
  double inverse_depth = 0;   ///< 1/m
  double variance_share = 1;  ///< of the value, over kappa^2; 1 = measured
  double slope_u = 0;         ///< d inverse depth / d u, 1/(m px); 0 where no plane was accepted
  double slope_v = 0;
};

std::vector<LocalPlane> fit_local_planes(const Correspondences& points, double kappa, double radius_px);

}  // namespace sextant
