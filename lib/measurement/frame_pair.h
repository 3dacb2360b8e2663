#pragma once

// The measurements of one frame pair reduced to points: what the pipeline needs after the images are gone.

#include <cstdint>
#include <map>
#include <vector>

#include "sextant/geometry/camera.h"
#include "sextant/measurement/correspondences.h"
#include "sextant/measurement/measurement_noise.h"

namespace sextant {

/// One instance of the current frame's mask, with the points of the previous frame whose flow lands on it.
struct ObjectObservation {
  int instance = 0;                     ///< id in the current mask
  double area_fraction = 0;             ///< its share of the current image, 0..1
  Correspondences points;               ///< every n-th pixel of the previous frame's instances
  std::vector<uint16_t> instance_prev;  ///< per point: id in the previous mask (never 0)
  int n_background = 0;                 ///< samples that land here from the previous background
};

struct FramePair {
  int prev = 0;  ///< frame number k-1
  int curr = 0;  ///< frame number k
  double dt_s = 0;
  int width = 0;
  int height = 0;
  StereoCamera camera;
  Correspondences background;              ///< static features
  std::vector<ObjectObservation> objects;  ///< in order of `instance`
  std::vector<int> lost_instances;         ///< ids of the previous mask that the current one lacks
  /// Declared by body: id in the previous mask, 0 = background. Empty: nothing is known.
  std::map<int, MeasurementNoise> noise;
};

}  // namespace sextant
