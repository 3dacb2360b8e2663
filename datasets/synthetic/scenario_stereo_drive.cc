#include <cmath>

#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/street_along.h"

namespace sextant::synthetic {
namespace {

constexpr int n_frames = 30;
constexpr double lane_m = 1.75;

/// Bends to the right, then to the left.
Route route() { return {{0, 0, 0}, {{14, 0}, {24, 22 * degree}, {10, 0}, {26, -26 * degree}, {0, 0}}}; }

/// A place beside the route.
Stance beside(double way_m, double right_m, double turn_rad = 0) {
  Stance at = route().at(way_m);
  at.x_m += right_m * std::cos(at.heading_rad);
  at.z_m -= right_m * std::sin(at.heading_rad);
  at.heading_rad += turn_rad;
  return at;
}

}  // namespace

Scenario stereo_drive() {
  Scenario s;
  s.camera = {{721.5377, 721.5377, 609.5593, 172.854}, 384.38};
  const auto ego = drive(route(), 0, n_frames, {{0, 0.78}, {12, 0.92}, {20, 0.86}, {30, 0.95}});
  s.T_world_camera = camera_on(ego, 0.8);
  Cast cast(s);
  cast.moving(saloon(red), drive(route(), 11.5, n_frames, {{0, 0.80}, {12, 0.88}, {22, 0.93}}));
  std::vector<Stance> oncoming;
  for (int k = 0; k < n_frames; ++k) oncoming.push_back(beside(47 - 0.85 * k, -2 * lane_m, 180 * degree));
  cast.moving(small(yellow), oncoming);
  std::vector<Stance> second;
  for (int k = 0; k < n_frames; ++k) second.push_back(beside(71 - 0.8 * k, -2 * lane_m, 180 * degree));
  cast.moving(delivery_van(white), second);
  cast.parked(wagon(blue), beside(13, 3.0));
  cast.parked(saloon(silver), beside(21, 3.0, 0.02));
  cast.parked(small(green), beside(37, 3.05));
  cast.parked(saloon(black), beside(17, -6.4, 180 * degree));
  cast.parked(wagon(white), beside(30, -6.4, 181 * degree));

  StreetWay way{.clearance_m = 2.6, .seed = 41};
  for (double at_m = 0; at_m <= 85; at_m += 1.0) {
    const Stance middle = beside(at_m, -lane_m);
    way.points.push_back(
        {{middle.x_m, 0, middle.z_m}, {std::sin(middle.heading_rad), 0, std::cos(middle.heading_rad)}});
  }
  way.dashes_m = 0;
  s.world = make_street_along(way);
  return s;
}

}  // namespace sextant::synthetic
