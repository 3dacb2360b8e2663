#include "sextant/datasets/synthetic/shading.h"

#include <algorithm>
#include <cmath>

#include "sextant/datasets/synthetic/sun.h"

namespace sextant::synthetic {

using Eigen::Vector3d;
using Eigen::Vector3f;

Shader::Shader(const Bodies& bodies, const View& view, const PinholeCamera& camera)
    : bodies_(bodies),
      view_(view),
      R_world_camera_(view.T_world_camera.rotation().toRotationMatrix()),
      to_sun_(to_sun()),
      per_fx_(static_cast<float>(1 / camera.fx)),
      per_fy_(static_cast<float>(1 / camera.fy)),
      facet_of_(bodies.n_surfaces(), 0) {
  for (const auto& T : view.T_camera_body) T_body_camera_.push_back(T.value_or(SE3()).inverse());
}

const Shader::Facet& Shader::facet(uint32_t surface, const Vector3d& ray) {
  uint32_t& index = facet_of_[surface];
  if (index != 0) return facets_[index - 1];
  const uint32_t body = bodies_.body_of(surface);
  const Patch& patch = bodies_.mesh(body).patches[bodies_.triangle(surface).patch];
  const SE3& T_body_camera = T_body_camera_[body];
  const Eigen::Quaterniond R_camera_body = T_body_camera.rotation().conjugate();
  Vector3d normal = view_.surfaces.normal(surface);
  if (normal.dot(ray) > 0) normal = -normal;
  Facet f;
  f.look = &patch.look;
  f.u_axis = (R_camera_body * patch.u_axis).cast<float>();
  f.v_axis = (R_camera_body * patch.v_axis).cast<float>();
  f.normal = normal.cast<float>();
  f.u = static_cast<float>(patch.u_axis.dot(T_body_camera.translation() - patch.origin));
  f.v = static_cast<float>(patch.v_axis.dot(T_body_camera.translation() - patch.origin));
  const Vector3d normal_world = R_world_camera_ * normal;
  const auto sun = static_cast<float>(std::max(0.0, normal_world.dot(to_sun_)));
  const auto open = static_cast<float>(0.5 - 0.5 * normal_world.y());  // how much of the sky it faces
  f.sky_light = Vector3f(0.36F, 0.40F, 0.47F) * (0.55F + 0.75F * open);
  f.sun_light = Vector3f(1.02F, 0.96F, 0.86F) * sun;
  facets_.push_back(f);
  index = static_cast<uint32_t>(facets_.size());
  return facets_.back();
}

Vector3f Shader::colour(uint32_t surface, bool shadowed, const Vector3d& ray) {
  if (surface == Bodies::kSky) return sky_colour(R_world_camera_ * ray);
  const Facet& f = facet(surface, ray);
  const Vector3f r = ray.cast<float>();
  const auto depth_m = static_cast<float>(view_.surfaces.depth_m(surface, ray));
  const float u_r = f.u_axis.dot(r), v_r = f.v_axis.dot(r);

  // p = z(x, y) r(x, y) with z = d / (n.r): its derivatives by the pixel, along the texture's axes.
  const float slant = std::min(f.normal.dot(r), -1e-4F);
  const float x_m = depth_m * per_fx_, y_m = depth_m * per_fy_;
  const float tilt_x = f.normal.x() / slant, tilt_y = f.normal.y() / slant;
  Footprint footprint;
  footprint.u = depth_m * u_r + f.u;
  footprint.v = depth_m * v_r + f.v;
  footprint.u_x = x_m * (f.u_axis.x() - u_r * tilt_x);
  footprint.v_x = x_m * (f.v_axis.x() - v_r * tilt_x);
  footprint.u_y = y_m * (f.u_axis.y() - u_r * tilt_y);
  footprint.v_y = y_m * (f.v_axis.y() - v_r * tilt_y);
  const Vector3f albedo = surface_colour(*f.look, footprint);

  Vector3f light = f.sky_light;
  if (!shadowed) light += f.sun_light;
  Vector3f colour = albedo.cwiseProduct(light);
  const float length = std::sqrt(r.squaredNorm());
  if (f.look->material == Material::glass || f.look->material == Material::paint) {
    // A mirror image of the sky, stronger at grazing angles.
    const float facing = -slant / length;
    const float grazing = (1 - facing) * (1 - facing);
    const float mirror = 0.04F + 0.35F * grazing * grazing;
    const Vector3d reflected = R_world_camera_ * Vector3d(ray / static_cast<double>(length) +
                                                          (2 * facing * f.normal).cast<double>());
    const auto up = static_cast<float>(std::clamp(0.5 - 1.5 * reflected.y(), 0.0, 1.0));
    colour += mirror * up * Vector3f(0.8F, 0.85F, 0.92F);
  }
  // 1 - exp(-range / 700 m), by the inverse of the exponential's series.
  const float t = depth_m * length / 700.0F;
  const float haze = 1.0F - 1.0F / (1.0F + t * (1.0F + t * (0.5F + t * 0.1667F)));
  return colour + haze * (Vector3f(0.78F, 0.83F, 0.90F) - colour);
}

}  // namespace sextant::synthetic
