#pragma once

// Ground under a street that follows a path: a grid of heights, cut into bands by the distance to the road's
// edge. All distances are measured in the plane of x and z.

#include <vector>

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

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
