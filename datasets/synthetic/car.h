#pragma once

// A passenger car as a mesh. Its own axes: x right, y down with the wheels' lowest points at 0, z ahead,
// origin in the middle of the ground face.

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

struct CarShape {
  Eigen::Vector3f colour{0.6F, 0.1F, 0.1F};
  double length_m = 4.3;
  double width_m = 1.78;
  double height_m = 1.46;
  bool van = false;  ///< roof to the rear end, no boot
  /// Wheels and bumpers reach into the corners of the box, as where a label's box is to be filled; the body
  /// is slimmer in between.
  bool fills_box = false;
  uint32_t seed = 1;
};

Mesh make_car(const CarShape& shape);

}  // namespace sextant::synthetic
