#pragma once

// The bodies of a scenario as one of its cameras sees them in one frame. Shared by the files of Renderer.

#include <memory>
#include <optional>
#include <vector>

#include "sextant/datasets/synthetic/ray_scene.h"
#include "sextant/datasets/synthetic/renderer.h"

namespace sextant::synthetic {

struct Renderer::View {
  int frame = 0;
  SE3 T_world_camera;
  std::vector<std::optional<SE3>> T_camera_body;
  std::unique_ptr<RayScene> scene;
};

}  // namespace sextant::synthetic
