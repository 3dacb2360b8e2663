#pragma once

// Visible triangle at each pixel: a z-buffer over all bodies of a scene.
//
// A triangle with corners a, b, c (camera coordinates) covers the ray r = ((x - cx) / fx, (y - cy) / fy, 1)
// if (b x c).r, (c x a).r and (a x b).r have the sign of its determinant. These functions are linear in x and
// y and need no clipping (Olano and Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997).
// Adjacent triangles share the edge function up to its sign, so no pixel is lost between them. Depth is that
// of the triangle's plane n.p = d: z = d / (n.r), in double precision.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "sextant/datasets/synthetic/mesh.h"
#include "sextant/geometry/camera.h"
#include "sextant/measurement/image.h"

namespace sextant::synthetic {

/// The meshes of a scene. Every triangle of every mesh has one number of its own, its surface.
class Bodies {
 public:
  static constexpr uint32_t sky_surface = 0xffffffffU;

  explicit Bodies(std::vector<Mesh> meshes);
  Bodies(const Bodies&) = delete;  // patches_ point into meshes_
  Bodies& operator=(const Bodies&) = delete;

  const Mesh& mesh(size_t body) const { return meshes_[body]; }
  size_t size() const { return meshes_.size(); }
  uint32_t first_surface(size_t body) const { return first_surface_[body]; }
  uint32_t n_surfaces() const { return first_surface_.back(); }
  uint32_t body_of(uint32_t surface) const { return body_of_[surface]; }
  const Patch& patch(uint32_t surface) const { return *patches_[surface]; }

 private:
  std::vector<Mesh> meshes_;
  std::vector<uint32_t> first_surface_;
  std::vector<uint16_t> body_of_;
  std::vector<const Patch*> patches_;  ///< patch of every surface
};

/// A subset of the pixels of an image, ordered by row and column.
class Spots {
 public:
  /// Selects the pixels whose value is not 0.
  explicit Spots(const Image<uint8_t>& marked);

  size_t size() const { return x_.size(); }
  /// Returns the index of the first pixel of row y, 0 <= y <= height.
  uint32_t first(int y) const { return first_[y]; }
  /// Returns the number of pixels in row y before column x, 0 <= x <= width.
  uint16_t before(int x, int y) const { return before_[static_cast<size_t>(y) * (width_ + 1) + x]; }
  /// Columns of all pixels.
  const std::vector<float>& x() const { return x_; }

 private:
  int width_;
  std::vector<float> x_;
  std::vector<uint32_t> first_;
  std::vector<uint16_t> before_;
};

/// The bodies in the coordinates of one camera. Bodies without a pose are absent.
class Surfaces {
 public:
  Surfaces(const Bodies& bodies, std::span<const std::optional<SE3>> T_camera_body,
           const PinholeCamera& camera, int width, int height);

  /// Returns the depth (m) of a surface along a ray with z = 1, clamped to the triangle's range of depths.
  double depth_m(uint32_t surface, const Eigen::Vector3d& ray) const {
    const Plane& p = planes_[surface];
    const double z = p.distance / p.normal.dot(ray);
    return z >= p.nearest_m ? std::min(z, p.farthest_m) : (z > 0 ? p.nearest_m : p.farthest_m);
  }
  /// The plane of a triangle in camera coordinates: normal . p = distance; the normal has either sign.
  struct Plane {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double distance = 0;
    double nearest_m = 0, farthest_m = 0;
  };
  /// A pixel is inside if x >= slope y + offset (side 1) or x <= slope y + offset (side -1); side 0: if slope
  /// y + offset >= 0.
  struct Edge {
    double slope, offset;
    int side;
  };
  /// The edges of a triangle that may be visible, and its inverse depth a x + b y + c in pixels.
  struct Scan {
    std::array<Edge, 3> edges;
    std::array<double, 3> inverse_depth;
    double top, bottom;  ///< range of y that it may touch
    uint32_t surface;
  };
  /// Plane of a visible surface.
  const Plane& plane(uint32_t surface) const { return planes_[surface]; }
  const Eigen::Vector3d& normal(uint32_t surface) const { return planes_[surface].normal; }

  /// Returns the visible surface at every pixel's centre, sky_surface if there is none.
  Image<uint32_t> seen() const;
  /// Returns the visible surfaces at (x + dx, y + dy) for some pixels (x, y).
  std::vector<uint32_t> seen_at(const Spots& spots, double dx, double dy) const;

 private:
  void add_body(const Bodies& bodies, size_t body, const SE3& T_camera_body);
  void add_triangle(const std::array<Eigen::Vector3d, 3>& corners, const Eigen::Vector3d& normal,
                    uint32_t surface);

  PinholeCamera camera_;
  int width_, height_;
  std::vector<Plane> planes_;
  std::vector<Scan> scans_;
};

}  // namespace sextant::synthetic
