#pragma once

// Rays against a static mesh and rigidly moving ones, by Embree. Directions have z = 1 in camera coordinates,
// so the parameter along a ray is the depth.
//
// Embree finds which triangle is hit in single precision; the depth is then computed from the triangle's
// plane in double precision. Deterministic: structures are built by one thread, and what a ray hits does not
// depend on others.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sextant/datasets/synthetic/mesh.h"
#include "sextant/geometry/se3.h"

namespace sextant::synthetic {

/// Where a ray ends. `body` is an index into the bodies of the scene, kNone for the sky.
struct Hit {
  static constexpr uint32_t kNone = 0xffffffffU;
  uint32_t body = kNone;
  uint32_t triangle = 0;
  double depth_m = 0;
  bool shadowed = false;
};

/// Meshes with their search structures; shared by all frames.
class Bodies {
 public:
  explicit Bodies(std::vector<Mesh> meshes);
  ~Bodies();
  Bodies(const Bodies&) = delete;
  Bodies& operator=(const Bodies&) = delete;

  const Mesh& mesh(size_t body) const { return meshes_[body]; }
  size_t size() const { return meshes_.size(); }

 private:
  friend class RayScene;
  struct Handles;
  std::vector<Mesh> meshes_;
  std::unique_ptr<Handles> handles_;
};

/// The bodies at one instant. Safe to use from one thread; several scenes may share Bodies across threads.
class RayScene {
 public:
  static constexpr int kWidth = 8;  ///< rays at once
  using Directions = std::array<Eigen::Vector3d, kWidth>;
  using Hits = std::array<Hit, kWidth>;

  /// A body without a pose is not there.
  RayScene(const Bodies& bodies, std::span<const std::optional<SE3>> T_camera_body,
           const Eigen::Vector3d& to_sun_camera);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Casts the first `n` rays from the camera; with `shadows` also looks from there to the sun.
  void cast(const Directions& rays, int n, bool shadows, Hits& hits) const;

  /// The triangle's normal in camera coordinates, turned to the camera.
  Eigen::Vector3d normal(const Hit& hit, const Eigen::Vector3d& ray) const;

 private:
  struct Handle;
  void cast_shadows(const Directions& rays, int n, Hits& hits) const;

  const Bodies& bodies_;
  std::vector<SE3> T_body_camera_;  ///< identity for those not there, which no ray hits
  std::vector<Eigen::Matrix3d> R_camera_body_;
  Eigen::Vector3d to_sun_;
  std::unique_ptr<Handle> handle_;
};

}  // namespace sextant::synthetic
