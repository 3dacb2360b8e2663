#pragma once

// A street along a given way through the world: hilly ground, a road with marks, pavements, houses, trees and
// posts. For scenes made from recorded trajectories.
//
// Ground height is a smooth mean of the given ground points, those nearest counting most: h(x, z) =
// sum w_i y_i / sum w_i with w_i = (d_i^2 + 4 m^2)^-2 (0.3 times that for `keep_free`), 2 cm lower. It is
// road within `road_half_m` of the way and within 3.2 m of `keep_free`, then pavement, then grass. No house,
// tree or post comes within `clearance_m` of the way or of a point of `keep_free`, nor cuts a line of
// `sight`.

#include <vector>

#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {

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
