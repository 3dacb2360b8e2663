#pragma once

// One rigid body between two frames: everything an estimator sees. Body 0 (the static background) and the
// objects share this type.

#include "sextant/geometry/camera.h"
#include "sextant/measurement/correspondences.h"

namespace sextant {

struct Problem {
  StereoCamera camera;
  Correspondences points;
};

}  // namespace sextant
