#pragma once

// Streets: their furniture, a straight street, and one along a path.
//
// Furniture of a street: houses, trees and lamp posts, each made from the next random numbers of one seed.

#include <optional>
#include <vector>

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

inline constexpr double kerb_m = 0.14;  ///< height of a pavement over the road

class Furnisher {
 public:
  explicit Furnisher(uint32_t seed) : seed_(seed) {}

  uint32_t next_seed() { return hash3(seed_, 77, ++things_); }
  /// Returns a number uniform in [low, high) for the next object.
  double draw(double low, double high) { return low + (high - low) * (next_seed() * 0x1p-32); }

  double house_height_m();
  /// Adds a house between two corners on the ground (at the y of `low`), with sides along x and z; walls
  /// extend `below_m` into the ground.
  void house(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double height_m, double below_m = 0);
  void tree(const Eigen::Vector3d& foot);
  /// Adds a lamp post with an arm along +x or -x.
  void post(const Eigen::Vector3d& foot, double arm_sign);

  Mesh mesh;

 private:
  uint32_t seed_;
  uint32_t things_ = 0;
};

// Static part of the scenes: roads with marks, raised pavements, houses, trees and lamp posts. The road runs
// along z around x = 0 from z_from_m to z_to_m, with houses at its ends; with `crossing_z_m` a second road of
// the same width crosses it there.

struct StreetPlan {
  double z_from_m = -40;
  double z_to_m = 160;
  double road_half_m = 5.8;  ///< distance from the kerb to the middle of the road
  double pavement_m = 3.4;   ///< width of the pavement
  std::optional<double> crossing_z_m;
  double arm_m = 70;  ///< length of the crossing road to either side
  uint32_t seed = 1;
};

Mesh make_street(const StreetPlan& plan);

// A street along a given path through the world: hilly ground, a road with marks, pavements, houses, trees
// and posts. For scenes made from recorded trajectories.
//
// The ground height is a smooth mean of the given ground points, dominated by the nearest: h(x, z) = sum w_i
// y_i / sum w_i with w_i = (d_i^2 + 4 m^2)^-2 (0.3 times that for `keep_free`), 2 cm lower. The surface is
// road within `road_half_m` of the path and within 3.2 m of `keep_free`, then pavement, then grass. No house,
// tree or post comes within `clearance_m` of the path or of a point of `keep_free`, nor intersects a line of
// `sight`.

struct StreetWay {
  struct Point {
    Eigen::Vector3d ground;  ///< world, m; y down
    Eigen::Vector3d ahead;   ///< direction of travel, world; its y component is ignored
  };
  struct Line {
    Eigen::Vector3d from, to;
  };

  std::vector<Point> points;               ///< in order; consecutive points may coincide
  std::vector<Eigen::Vector3d> keep_free;  ///< on the ground, world: positions of objects
  std::vector<Line> sight;                 ///< lines in bird's eye view that must stay unobstructed
  double road_half_m = 5.8;
  double pavement_m = 3.4;
  double clearance_m = 4.0;
  double dashes_m = -1.75;  ///< dashed line, distance to the right of the path
  double before_m = 40;     ///< length of the straight part before the first point
  double after_m = 120;     ///< length of the straight part after the last point
  uint32_t seed = 1;
};

/// Throws Error if there are no points, if a point or position is not finite, if a point has no horizontal
/// direction, if consecutive points are more than a kilometre apart, or if the terrain would have more than
/// 36 km^2.
Mesh make_street_along(const StreetWay& way);

// ---- Terrain (terrain.cc): the ground under a street that follows a path: a grid of heights, cut into bands
// by the distance to the road's edge. All distances are measured in the plane of x and z.

class Terrain {
 public:
  /// A point that attracts the ground to its height.
  struct Support {
    Eigen::Vector3d place;
    double weight = 1;
  };
  /// A disc of road.
  struct Disc {
    Eigen::Vector3d place;
    double radius_m = 0;
  };
  /// Covers everything within `margin_m` of the supports, of which there must be at least one. Throws Error
  /// if that is more than 36 km^2.
  Terrain(const std::vector<Support>& supports, const std::vector<Disc>& road, double margin_m);

  /// Returns the y coordinate (down, m) of the mesh surface; outside the grid, that of the nearest point.
  double height(double x, double z) const;
  /// Adds road, kerb, pavement and grass to a mesh.
  void add_to(Mesh& mesh, double pavement_m) const;

 private:
  struct Node {
    double weight = 0;
    double y = 0;         ///< weighted sum, then the height
    double edge_m = 1e3;  ///< distance to the road's edge, negative on the road
    bool drawn = false;
  };
  struct Corner {
    Eigen::Vector3d at;
    double edge_m;
  };
  template <typename Visit>
  void visit_near(const Eigen::Vector3d& place, double radius_m, const Visit& visit);
  Corner corner(int i, int j) const;
  void add_triangle(const std::vector<Corner>& corners, const std::vector<double>& bands,
                    uint32_t first_patch, Mesh& mesh) const;

  double x0_ = 0, z0_ = 0;
  int n_x_ = 0, n_z_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace sextant::synthetic
