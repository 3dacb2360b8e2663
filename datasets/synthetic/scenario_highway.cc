#include <cmath>

#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/furniture.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

constexpr int n_frames = 40;
constexpr double lane_m = 3.6;
constexpr double from_m = -60, to_m = 320;
const Eigen::Vector3f asphalt_grey(0.36F, 0.36F, 0.37F), concrete_grey(0.58F, 0.57F, 0.54F),
    meadow(0.30F, 0.36F, 0.20F);

/// Three lanes each way, a concrete barrier between them, guard rails, noise walls and trees outside.
class Motorway : Furnisher {
 public:
  Motorway() : Furnisher(31) {}

  Mesh build() {
    strip({Material::grass, meadow, 103, 0}, -200, 200, 0.08, 0);
    carriageway(0);
    carriageway(-16.2);
    barrier(-8.1);
    rail(8.0);
    rail(-24.2);
    wall(15, 4.2);
    wall(-31, 5.0);
    trees(11.2);
    trees(-27.2);
    // Beyond the end: a bridge across the road, and houses behind it.
    const Look concrete{Material::plaster, concrete_grey, next_seed(), 0};
    mesh.add_box(concrete, concrete, {-40, -6.6, to_m - 120}, {24, -5.2, to_m - 112});
    for (const double x : {-32.0, -8.1, 16.0}) {
      mesh.add_box(concrete, concrete, {x - 0.4, -5.2, to_m - 117}, {x + 0.4, 0.1, to_m - 115});
    }
    house({-120, 0, to_m}, {120, 0, to_m + 14}, 22);
    return std::move(mesh);
  }

 private:
  void strip(const Look& look, double x0, double x1, double y, double u_from) {
    mesh.add_polygon(look, {{x0, y, from_m}, {x1, y, from_m}, {x1, y, to_m}, {x0, y, to_m}}, {u_from, 0, 0},
                     Vector3d::UnitX(), Vector3d::UnitZ());
  }
  /// Dashes between the lanes, solid lines at the edges.
  void carriageway(double middle_x) {
    const double edge = 1.5 * lane_m;
    for (const double line : {-0.5 * lane_m, 0.5 * lane_m}) {
      const Look dashed{Material::road, asphalt_grey, 101, 100};
      strip(dashed, middle_x + line - 0.5 * lane_m, middle_x + line + 0.5 * lane_m, 0, middle_x + line);
    }
    for (const double side : {-1.0, 1.0}) {
      const Look solid{Material::road, asphalt_grey, 101, 50};
      const double inner = middle_x + side * lane_m, outer = middle_x + side * (edge + 2.3);
      strip(solid, std::min(inner, outer), std::max(inner, outer), 0, middle_x + side * (edge - 50));
    }
  }
  void barrier(double x) {
    const Look concrete{Material::plaster, concrete_grey, next_seed(), 0};
    mesh.add_box(concrete, concrete, {x - 0.25, -0.95, from_m}, {x + 0.25, 0.1, to_m});
  }
  void rail(double x) {
    const Look metal{Material::metal, {0.50F, 0.52F, 0.54F}, next_seed(), 0};
    mesh.add_box(metal, metal, {x - 0.05, -0.78, from_m}, {x + 0.05, -0.45, to_m});
    for (double z = from_m; z < to_m; z += 4) {
      mesh.add_box(metal, metal, {x - 0.04, -0.46, z - 0.06}, {x + 0.04, 0.1, z + 0.06});
    }
  }
  /// Panels of several tints between posts.
  void wall(double x, double height_m) {
    const Look post{Material::metal, {0.30F, 0.33F, 0.32F}, next_seed(), 0};
    for (double z = from_m; z < to_m; z += 5) {
      const auto tint = static_cast<float>(draw(0.75, 1.15));
      const Look panel{Material::plaster, Eigen::Vector3f(0.47F, 0.50F, 0.42F) * tint, next_seed(), 0};
      mesh.add_box(panel, panel, {x - 0.1, -height_m, z}, {x + 0.1, 0.1, z + 5});
      mesh.add_box(post, post, {x - 0.16, -height_m - 0.15, z - 0.12}, {x + 0.16, 0.1, z + 0.12});
    }
  }
  void trees(double x) {
    for (double z = from_m + 5; z < to_m - 5; z += draw(6, 11)) tree({x, 0.08, z});
  }
};

/// In a lane (-1 left, 0 the camera's, 1 right), with small waves of speed.
void car(Cast& cast, const CarShape& shape, double lane, double z_m, double step_m, double phase,
         double heading_rad = 0) {
  const double x_m = lane * lane_m;
  cast.moving(shape, {x_m, z_m, heading_rad}, [=](int k) {
    return Advance{step_m + 0.03 * std::sin(0.35 * k + phase), 0.0015 * std::cos(0.3 * k + phase)};
  });
}

}  // namespace

Scenario highway() {
  Scenario s;
  s.world = Motorway().build();
  s.T_world_camera =
      camera_on(drive({0, 0, 0}, n_frames,
                      [](int k) {
                        return Advance{1.00 + 0.04 * std::sin(0.2 * k), 0.001 * std::cos(0.25 * k)};
                      }),
                1.0);
  Cast cast(s);
  car(cast, delivery_van(white), 0, 9.2, 1.005, 0.3);
  car(cast, delivery_van(blue), -0.93, 6.6, 1.02, 1.0);
  car(cast, delivery_van(silver), 0.93, 6.2, 0.99, 2.0);
  car(cast, wagon(red), -0.95, 14.5, 1.03, 2.5);
  car(cast, saloon(black), 0.96, 14.0, 0.985, 0.8);
  car(cast, saloon(yellow), 0.02, 18.5, 1.01, 1.6);
  car(cast, delivery_van(green), -1.0, 23.5, 1.02, 0.1);
  car(cast, delivery_van(red), 1.0, 22.5, 1.0, 1.2);
  car(cast, saloon(silver), 0.0, 28.0, 1.02, 2.2);
  car(cast, small(blue), 1.0, 34.0, 1.01, 0.4);
  car(cast, wagon(white), -1.0, 36.0, 1.03, 1.9);
  // Towards the camera beyond the barrier.
  car(cast, saloon(green), -4.0, 55, 2.2, 0.5, std::numbers::pi);
  car(cast, delivery_van(yellow), -5.0, 95, 2.3, 1.5, std::numbers::pi);
  return s;
}

}  // namespace sextant::synthetic
