#pragma once

// Shadows: rays from surfaces to the sun, by Embree. Deterministic: structures are built by one thread, and
// what a ray hits does not depend on others.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>

#include "sextant/datasets/synthetic/raster.h"

namespace sextant::synthetic {

/// Direction to the sun, world.
Eigen::Vector3d to_sun();

/// Search structures of the bodies; shared by all frames.
class ShadowCasters {
 public:
  explicit ShadowCasters(const Bodies& bodies);
  ~ShadowCasters();
  ShadowCasters(const ShadowCasters&) = delete;
  ShadowCasters& operator=(const ShadowCasters&) = delete;

 private:
  friend class SunRays;
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

/// The bodies at one instant. Safe to use from one thread; several may share ShadowCasters across threads.
class SunRays {
 public:
  SunRays(const ShadowCasters& casters, std::span<const std::optional<SE3>> T_camera_body,
          const Eigen::Vector3d& to_sun_camera);
  ~SunRays();
  SunRays(const SunRays&) = delete;
  SunRays& operator=(const SunRays&) = delete;

  /// Whether something hides the sun from each point (camera coordinates, m).
  void cast(std::span<const Eigen::Vector3f> points, std::span<uint8_t> shadowed) const;

 private:
  struct Handle;
  Eigen::Vector3f to_sun_;
  std::unique_ptr<Handle> handle_;
};

}  // namespace sextant::synthetic
