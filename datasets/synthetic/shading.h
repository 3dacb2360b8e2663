#pragma once

// From surfaces to colours: the bodies that a camera sees, the sun with its shadows, and shading.
//
// The bodies of a scenario as one of its cameras sees them in one frame.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sextant/datasets/synthetic/raster.h"
#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/datasets/synthetic/texture.h"

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

// Shadows: rays from surfaces to the sun, by Embree. Deterministic: structures are built by one thread, and
// what a ray hits does not depend on others.

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

// Colour of what is seen along rays: texture, sun, sky light and haze. Samples of one look are shaded
// together.

/// Samples of one surface (or sky_surface): places in the image (pixels), 1 where the sun shines, else 0, and
/// numbers that say what each sample is for. All of one length.
struct Samples {
  std::span<const float> x, y, sun;
  std::span<const uint32_t> target;
};

class Shader {
 public:
  /// Gets the colours (linear, 0..about 1) of targets.
  class Sink {
   public:
    virtual void take(std::span<const uint32_t> targets, const Colours& colours) = 0;

   protected:
    ~Sink() = default;
  };

  Shader(const Bodies& bodies, const View& view, const PinholeCamera& camera, Sink& sink);

  /// Shades the samples, now or with others of the same look later: after flush() all are done.
  void shade(uint32_t surface, const Samples& samples);
  void flush();

  /// A linear function of the place in the image: x, y in pixels.
  struct Linear {
    float x = 0, y = 0, c = 0;
  };
  /// What does not change over a triangle. The normal is turned to the camera.
  struct Facet {
    Linear inverse_depth;  ///< 1 / m
    float distance_m = 0;  ///< of its plane
    float nearest_m = 0, farthest_m = 0;
    Linear u, v;                       ///< of the ray, along the texture's axes
    float u_camera = 0, v_camera = 0;  ///< texture coordinates at the camera, m
    float n_x = 0, n_y = 0;            ///< of the normal, camera, per focal length in pixels
    float normal_y = 0;                ///< world
    float sky_light[3] = {}, sun_light[3] = {};
  };
  /// World directions of rays, and with (x, y, 1) in focal lengths their lengths.
  struct Rays {
    Linear x, y, world_x, world_y, world_z;
  };
  /// What is known of a sample besides its texture.
  struct Light {
    Lane range_m;   ///< along the ray
    Lane facing;    ///< cosine of ray and normal
    Lane mirror_y;  ///< of the mirrored ray, world
    Lane red, green, blue;
  };

 private:
  Facet facet(uint32_t surface, float x, float y) const;
  Linear linear(const Eigen::Vector3d& of_ray) const;

  const Bodies& bodies_;
  const View& view_;
  PinholeCamera camera_;
  Eigen::Matrix3d R_world_camera_;
  Eigen::Vector3d to_sun_;
  std::vector<Eigen::Matrix3d> R_camera_body_;
  std::vector<Eigen::Vector3d> camera_in_body_;
  Rays rays_;
  Sink& sink_;

  const Look* look_ = nullptr;  ///< of what waits; none: the sky
  int n_ = 0;                   ///< samples that wait
  Footprints footprints_;
  Light light_;
  Colours colours_;
  uint32_t targets_[NoiseTile::batch] = {};
};

}  // namespace sextant::synthetic
