#pragma once

// Colour of what a ray sees: texture, sun, sky light and haze.

#include "sextant/datasets/synthetic/ray_scene.h"

namespace sextant::synthetic {

/// Direction to the sun, world.
Eigen::Vector3d to_sun();

class Shader {
 public:
  /// `pixel` is the angle (rad) that one sample covers.
  Shader(const Bodies& bodies, const RayScene& scene, std::span<const std::optional<SE3>> T_camera_body,
         const SE3& T_world_camera, double pixel_rad);

  /// Colour 0..1 of a hit (or the sky) seen along `ray`, which has z = 1.
  Eigen::Vector3f colour(const Hit& hit, const Eigen::Vector3d& ray) const;

 private:
  const Bodies& bodies_;
  const RayScene& scene_;
  std::vector<SE3> T_body_camera_;
  Eigen::Matrix3d R_world_camera_;
  double pixel_rad_;
};

}  // namespace sextant::synthetic
