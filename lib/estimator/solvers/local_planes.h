#pragma once

// Inverse depth is an affine function of the pixel on every plane. Where the points around one agree with a
// plane within the noise of their depths, its slopes tell how inverse depth changes within a pixel.
//
// Neighbourhood: a square of about `radius_px` around, nine cells of a grid; the points of the middle one
// share it. It has relief where its residuals fail the chi-square test against kappa (1/m) at 99 %.

#include <vector>

#include "sextant/measurement/correspondences.h"

namespace sextant {

struct LocalPlane {
  bool fitted = false;  ///< false: too few points, or all in a row
  double slope_u = 0;   ///< d inverse depth / d u, 1/(m px)
  double slope_v = 0;
  double relief = 0;  ///< variance about the plane beyond that of kappa, 1/m^2; 0 = none
};

std::vector<LocalPlane> fit_local_planes(const Correspondences& points, double kappa, double radius_px);

}  // namespace sextant
