#pragma once

// The bodies of a scenario as one of its cameras sees them in one frame.

#include <optional>
#include <vector>

#include "sextant/datasets/synthetic/raster.h"
#include "sextant/datasets/synthetic/scenario.h"

namespace sextant::synthetic {

struct View {
  /// `right_m`: how far to the right of the scenario's left camera.
  View(const Scenario& scenario, const Bodies& bodies, int frame_number, double right_m);

  int frame;
  SE3 T_world_camera;
  std::vector<std::optional<SE3>> T_camera_body;  ///< body 0 is the world, body i the actor i - 1
  Surfaces surfaces;
  Image<uint32_t> seen;  ///< surface at each pixel's centre
};

}  // namespace sextant::synthetic
