#include "sextant/datasets/synthetic/shading.h"

#include <algorithm>
#include <cmath>

#include "sextant/datasets/synthetic/texture.h"

namespace sextant::synthetic {

using Eigen::Vector3d;
using Eigen::Vector3f;

Vector3d to_sun() { return Vector3d(0.55, -0.95, -0.42).normalized(); }

Shader::Shader(const Bodies& bodies, const RayScene& scene, std::span<const std::optional<SE3>> T_camera_body,
               const SE3& T_world_camera, double pixel_rad)
    : bodies_(bodies),
      scene_(scene),
      R_world_camera_(T_world_camera.rotation().toRotationMatrix()),
      pixel_rad_(pixel_rad) {
  for (const auto& T : T_camera_body) T_body_camera_.push_back(T.value_or(SE3()).inverse());
}

Vector3f Shader::colour(const Hit& hit, const Vector3d& ray) const {
  const Vector3d ray_world = R_world_camera_ * ray;
  if (hit.body == Hit::kNone) return sky_colour(ray_world);
  const Mesh& mesh = bodies_.mesh(hit.body);
  const Patch& patch = mesh.patches[mesh.triangles[hit.triangle].patch];
  const SE3& T_body_camera = T_body_camera_[hit.body];

  // The pixel's cone cuts the surface in an ellipse.
  const Vector3d normal = scene_.normal(hit, ray);
  const double length = ray.norm();
  const double range_m = hit.depth_m * length;
  const double facing = std::max(0.02, -normal.dot(ray) / length);
  const double minor_m = 0.5 * range_m * pixel_rad_;
  Vector3d downhill = ray / length + facing * normal;
  const double slope = downhill.norm();
  downhill = slope > 1e-6 ? Vector3d(downhill / slope) : Vector3d(Vector3d::Zero());
  const Vector3d major = T_body_camera.rotation() * Vector3d(downhill * (minor_m / facing));
  const Vector3d at = T_body_camera * Vector3d(hit.depth_m * ray) - patch.origin;

  Footprint footprint;
  footprint.u = patch.u_axis.dot(at);
  footprint.v = patch.v_axis.dot(at);
  footprint.major_m = {patch.u_axis.dot(major), patch.v_axis.dot(major)};
  footprint.minor_m = minor_m;
  const Vector3f albedo = surface_colour(patch.look, footprint);

  const Vector3d normal_world = R_world_camera_ * normal;
  const auto sun = static_cast<float>(std::max(0.0, normal_world.dot(to_sun())));
  const auto open = static_cast<float>(0.5 - 0.5 * normal_world.y());  // how much of the sky it faces
  Vector3f light = Vector3f(0.36F, 0.40F, 0.47F) * (0.55F + 0.75F * open);
  if (!hit.shadowed) light += Vector3f(1.02F, 0.96F, 0.86F) * sun;
  Vector3f colour = albedo.cwiseProduct(light);
  if (patch.look.material == Material::glass || patch.look.material == Material::paint) {
    // A mirror image of the sky, stronger at grazing angles.
    const auto mirror =
        static_cast<float>(0.04 + 0.35 * (1.0 - facing) * (1.0 - facing) * (1.0 - facing) * (1.0 - facing));
    const Vector3d reflected = ray_world / length + 2 * facing * normal_world;
    const auto up = static_cast<float>(std::clamp(0.5 - 1.5 * reflected.y(), 0.0, 1.0));
    colour += mirror * up * Vector3f(0.8F, 0.85F, 0.92F);
  }
  const auto haze = static_cast<float>(1.0 - std::exp(-range_m / 700.0));
  return colour + haze * (Vector3f(0.78F, 0.83F, 0.90F) - colour);
}

}  // namespace sextant::synthetic
