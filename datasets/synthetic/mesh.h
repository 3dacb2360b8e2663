#pragma once

// Triangle meshes of the synthetic scenes. Axes as in a camera that looks ahead: x right, y down, z forward
// (m); the ground is y = 0 and heights are negative.
//
// A mesh is a list of patches. A patch is one planar (or, for foliage, slightly curved) piece of surface with
// one look; its texture coordinates (m) are linear in the position: u = u_axis . (p - origin), v likewise.
// Surfaces are two-sided: the renderer turns normals towards the camera.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "sextant/geometry/se3.h"

namespace sextant::synthetic {

enum class Material : uint8_t {
  asphalt,  ///< plain road
  road,     ///< u across from the middle, v along; dashed middle line, solid lines at +-extent
  stripes,  ///< pedestrian crossing: bars along v
  paving,   ///< slabs
  grass,
  facade,   ///< u along the street, v up from the ground
  plaster,  ///< plain walls, roofs
  bark,
  foliage,
  metal,
  paint,  ///< car body; u along, v up
  glass,
  tyre,
};

struct Look {
  Material material = Material::plaster;
  Eigen::Vector3f colour{0.5F, 0.5F, 0.5F};  ///< 0..1
  uint32_t seed = 0;
  float extent = 0;  ///< m, see Material
};

struct Patch {
  Look look;
  Eigen::Vector3d origin, u_axis, v_axis;
};

struct Triangle {
  std::array<uint32_t, 3> vertices;
  Eigen::Vector3d normal;  ///< unit length, either sign
  uint32_t patch = 0;
};

struct Mesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;
  std::vector<Patch> patches;

  /// Adds a convex polygon. u runs along its first edge, v perpendicular to it in the plane.
  void add_polygon(const Look& look, const std::vector<Eigen::Vector3d>& points);
  /// Overload with given texture axes.
  void add_polygon(const Look& look, const std::vector<Eigen::Vector3d>& points,
                   const Eigen::Vector3d& origin, const Eigen::Vector3d& u_axis,
                   const Eigen::Vector3d& v_axis);
  /// Adds an axis-parallel box from `low` to `high` without its bottom; `sides` and `top` may look different.
  void add_box(const Look& sides, const Look& top, const Eigen::Vector3d& low, const Eigen::Vector3d& high);
  /// Adds a cylinder or cone frustum between two points, without ends.
  void add_tube(const Look& look, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                double radius_from_m, double radius_to_m, int sides);
  /// Adds an irregular ball; the same seed gives the same shape.
  void add_blob(const Look& look, const Eigen::Vector3d& centre, const Eigen::Vector3d& radii_m);

  /// Adds all of another mesh, whose coordinates are those of frame b.
  void append(const Mesh& other, const SE3& T_this_b);
  /// Adds a convex polygon with the look of patch `patch`.
  void add_fan(const std::vector<Eigen::Vector3d>& points, uint32_t patch);
};

/// Returns a hash of three numbers, the only source of randomness of the geometry of the scenes.
uint32_t hash3(uint32_t a, uint32_t b, uint32_t c);
/// Returns hash3() as a number in [0, 1).
double random01(uint32_t a, uint32_t b, uint32_t c);

// A passenger car as a mesh. Axes: x right, y down, with the lowest points of the wheels at 0, z ahead;
// origin in the middle of the ground face.

struct CarShape {
  Eigen::Vector3f colour{0.6F, 0.1F, 0.1F};
  double length_m = 4.3;
  double width_m = 1.78;
  double height_m = 1.46;
  bool van = false;  ///< roof up to the rear end, no boot
  /// Wheels and bumpers extend to the corners of the box, for objects that should fill their label's box; the
  /// body is slimmer in between.
  bool fills_box = false;
  uint32_t seed = 1;
};

Mesh make_car(const CarShape& shape);

}  // namespace sextant::synthetic
