#pragma once

// The static part of the scenes: roads with marks, raised pavements, houses, trees and lamp posts. The road
// runs along z around x = 0 from z_from_m to z_to_m, its ends closed by houses; with `crossing_z_m` a second
// road of the same width crosses it there.

#include <optional>

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

struct StreetPlan {
  double z_from_m = -40;
  double z_to_m = 160;
  double road_half_m = 5.8;  ///< the kerb's distance from the middle
  double pavement_m = 3.4;   ///< its width
  std::optional<double> crossing_z_m;
  double arm_m = 70;  ///< length of the crossing road to either side
  uint32_t seed = 1;
};

Mesh make_street(const StreetPlan& plan);

}  // namespace sextant::synthetic
