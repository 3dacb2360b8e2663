#pragma once

// Streets: their furniture, a straight one, and one along a path.
//
// What lines a street: houses, trees and lamp posts, each drawn from the next random numbers of one seed.

#include <optional>
#include <vector>

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

inline constexpr double kerb_m = 0.14;  ///< height of a pavement over the road

class Furnisher {
 public:
  explicit Furnisher(uint32_t seed) : seed_(seed) {}

  uint32_t next_seed() { return hash3(seed_, 77, ++things_); }
  /// Uniform in [low, high), of the next thing.
  double draw(double low, double high) { return low + (high - low) * (next_seed() * 0x1p-32); }

  double house_height_m();
  /// Between two corners on the ground (y of `low`), with sides along x and z; walls reach `below_m` into the
  /// ground.
  void house(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double height_m, double below_m = 0);
  void tree(const Eigen::Vector3d& foot);
  /// Lamp post; its arm reaches along +x or -x.
  void post(const Eigen::Vector3d& foot, double arm_sign);

  Mesh mesh;

 private:
  uint32_t seed_;
  uint32_t things_ = 0;
};

// The static part of the scenes: roads with marks, raised pavements, houses, trees and lamp posts. The road
// runs along z around x = 0 from z_from_m to z_to_m, its ends closed by houses; with `crossing_z_m` a second
// road of the same width crosses it there.

struct StreetPlan {
  double z_from_m = -40;
  double z_to_m = 160;
  double road_half_m = 5.8;  ///< the kerb's distance from the middle
  double pavement_m = 3.4;   ///< its width
  std::optional<double> crossing_z_m;
  double arm_m = 70;  ///< length of the crossing road to either side
  uint32_t seed = 1;
};

Mesh make_street(const StreetPlan& plan);

// A street along a given way through the world: hilly ground, a road with marks, pavements, houses, trees and
// posts. For scenes made from recorded trajectories.
//
// Ground height is a smooth mean of the given ground points, those nearest counting most: h(x, z) =
// sum w_i y_i / sum w_i with w_i = (d_i^2 + 4 m^2)^-2 (0.3 times that for `keep_free`), 2 cm lower. It is
// road within `road_half_m` of the way and within 3.2 m of `keep_free`, then pavement, then grass. No house,
// tree or post comes within `clearance_m` of the way or of a point of `keep_free`, nor cuts a line of
// `sight`.

struct StreetWay {
  struct Point {
    Eigen::Vector3d ground;  ///< world, m; y down
    Eigen::Vector3d ahead;   ///< direction of travel, world; its y is not used
  };
  struct Line {
    Eigen::Vector3d from, to;
  };

  std::vector<Point> points;               ///< in order; may stand still
  std::vector<Eigen::Vector3d> keep_free;  ///< on the ground, world: where objects stand or drive
  std::vector<Line> sight;                 ///< seen from above: lines that must stay open
  double road_half_m = 5.8;
  double pavement_m = 3.4;
  double clearance_m = 4.0;
  double dashes_m = -1.75;  ///< dashed line, from the way to the right
  double before_m = 40;     ///< how far it goes on straight before the first point
  double after_m = 120;     ///< and after the last
  uint32_t seed = 1;
};

/// Throws Error when there are no points, one is not finite or has no direction, or the way leaps by a
/// kilometre or spans more than six.
Mesh make_street_along(const StreetWay& way);

}  // namespace sextant::synthetic
