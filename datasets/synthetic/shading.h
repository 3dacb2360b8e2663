#pragma once

// Colour of what is seen along a ray: texture, sun, sky light and haze.

#include "sextant/datasets/synthetic/texture.h"
#include "sextant/datasets/synthetic/view.h"

namespace sextant::synthetic {

class Shader {
 public:
  Shader(const Bodies& bodies, const View& view, const PinholeCamera& camera);

  /// Colour (linear, 0..about 1) of a surface (or kSky) seen along `ray`, which has z = 1.
  Eigen::Vector3f colour(uint32_t surface, bool shadowed, const Eigen::Vector3d& ray);

 private:
  /// What does not change over a triangle, in camera coordinates.
  struct Facet {
    const Look* look = nullptr;
    Eigen::Vector3f u_axis, v_axis, normal;  ///< the normal is turned to the camera
    float u = 0, v = 0;                      ///< texture coordinates at the camera
    Eigen::Vector3f sky_light, sun_light;
  };
  const Facet& facet(uint32_t surface, const Eigen::Vector3d& ray);

  const Bodies& bodies_;
  const View& view_;
  Eigen::Matrix3d R_world_camera_;
  Eigen::Vector3d to_sun_;
  float per_fx_, per_fy_;
  std::vector<SE3> T_body_camera_;
  std::vector<uint32_t> facet_of_;  ///< index + 1 into facets_
  std::vector<Facet> facets_;
};

}  // namespace sextant::synthetic
