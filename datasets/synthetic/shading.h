#pragma once

// From surfaces to colours: the bodies in a camera's view, the sun with its shadows, and shading.
//
// The bodies of a scenario in the view of one of its cameras in one frame.

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
  /// `right_m`: distance to the right of the scenario's left camera.
  View(const Scenario& scenario, const Bodies& bodies, int frame_number, double right_m);

  int frame;
  SE3 T_world_camera;
  std::vector<std::optional<SE3>> T_camera_body;  ///< body 0 is the world, body i is actor i - 1
  Surfaces surfaces;
  Image<uint32_t> seen;  ///< surface at each pixel's centre
};

// Shadows: rays from surfaces to the sun, by Embree. Deterministic: structures are built by one thread, and
// the result of a ray does not depend on other rays.

/// Returns the direction to the sun in world coordinates.
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

/// Casts rays to the sun among the bodies of one frame. An object is for use by one thread; objects of
/// several threads may share ShadowCasters.
class SunRays {
 public:
  SunRays(const ShadowCasters& casters, std::span<const std::optional<SE3>> T_camera_body,
          const Eigen::Vector3d& to_sun_camera);
  ~SunRays();
  SunRays(const SunRays&) = delete;
  SunRays& operator=(const SunRays&) = delete;

  /// Sets `shadowed` to 1 for each point (camera coordinates, m) that is hidden from the sun, otherwise to 0.
  void cast(std::span<const Eigen::Vector3f> points, std::span<uint8_t> shadowed) const;

 private:
  struct Handle;
  Eigen::Vector3f to_sun_;
  std::unique_ptr<Handle> handle_;
};

// Colour along rays: texture, sun, sky light and haze. Samples with one look are shaded together.

/// Samples of one surface (or sky_surface): positions in the image (pixels), 1 if the sun shines there, else
/// 0, and the target of each sample. All of equal length.
struct Samples {
  std::span<const float> x, y, sun;
  std::span<const uint32_t> target;
};

class Shader {
 public:
  /// Receives the colours (linear, 0..about 1) of targets.
  class Sink {
   public:
    virtual void take(std::span<const uint32_t> targets, const Colours& colours) = 0;

   protected:
    ~Sink() = default;
  };

  Shader(const Bodies& bodies, const View& view, const PinholeCamera& camera, Sink& sink);

  /// Shades the samples, immediately or later together with others of the same look; flush() completes all.
  void shade(uint32_t surface, const Samples& samples);
  void flush();

  /// A linear function of the position in the image: x, y in pixels.
  struct Linear {
    float x = 0, y = 0, c = 0;
  };
  /// Properties that are constant over a triangle. The normal points towards the camera.
  struct Facet {
    Linear inverse_depth;  ///< 1 / m
    float distance_m = 0;  ///< distance of its plane from the camera
    float nearest_m = 0, farthest_m = 0;
    Linear u, v;                       ///< coordinates of the ray along the texture's axes
    float u_camera = 0, v_camera = 0;  ///< texture coordinates at the camera, m
    float n_x = 0, n_y = 0;            ///< normal in camera axes, divided by the focal length in pixels
    float normal_y = 0;                ///< y component of the normal, world axes
    float sky_light[3] = {}, sun_light[3] = {};
  };
  /// Directions of the rays: (x, y, 1) in camera axes, whose norm is the length of a ray per depth, and in
  /// world axes.
  struct Rays {
    Linear x, y, world_x, world_y, world_z;
  };
  /// Lighting of a sample, apart from its texture.
  struct Light {
    Lane range_m;   ///< along the ray
    Lane facing;    ///< cosine of the angle between ray and normal
    Lane mirror_y;  ///< y component of the reflected ray, world axes
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

  const Look* look_ = nullptr;  ///< look of the pending samples; null: the sky
  int n_ = 0;                   ///< number of pending samples
  Footprints footprints_;
  Light light_;
  Colours colours_;
  uint32_t targets_[NoiseTile::batch] = {};
};

/// Returns the colour image of a view (painter.cc). Textures are filtered analytically; pixels on edges of
/// surfaces and of shadows are the mean of three samples.
Image<Rgb> paint(const Bodies& bodies, const ShadowCasters& casters, const View& view,
                 const PinholeCamera& camera);

}  // namespace sextant::synthetic
