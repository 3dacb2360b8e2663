#pragma once

// One rigid body between two frames: everything an estimator sees. Body 0 (the static background) and the
// objects share this type.

#include <optional>

#include "sextant/geometry/camera.h"
#include "sextant/measurement/correspondences.h"
#include "sextant/measurement/measurement_noise.h"

namespace sextant {

struct Problem {
  StereoCamera camera;
  Correspondences points;
  std::optional<MeasurementNoise> noise;  ///< as declared by the source; none: nothing is known
};

}  // namespace sextant
