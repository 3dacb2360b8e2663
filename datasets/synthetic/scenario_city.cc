#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

constexpr double crossing_m = 46;
constexpr double lane_m = 1.75;  // middle of a lane from the middle of the road
constexpr int n_frames = 160;
constexpr double north = 0, south = 180 * degree, east = 90 * degree, west = -90 * degree;

/// Up the street in the right lane, left at the crossing, down the arm in the right lane.
Route ego_route() {
  const double radius_m = 9;
  return {{lane_m, 0, north},
          {{crossing_m + lane_m - radius_m, 0}, {radius_m * 90 * degree, -90 * degree}, {0, 0}}};
}

std::vector<Stance> straight(const Stance& start, const Speeds& speeds) {
  return drive(Route{start, {{0, 0}}}, 0, n_frames, speeds);
}

void traffic(Cast& cast) {
  // Ahead in the own lane; it does not stop.
  cast.moving(saloon(silver), straight({lane_m, 13, north}, {{0, 0.64}, {40, 0.60}, {60, 0.85}}));
  // Coming towards the camera: one passes on the street, one while it stands, one later behind it.
  cast.moving(wagon(red), straight({-lane_m, 62, south}, {{0, 0.80}, {50, 0.85}}), 0, 75);
  cast.moving(small(yellow), straight({-lane_m, 112, south}, {{0, 1.10}, {70, 1.02}}), 0, 110);
  // Across the street while the camera stands.
  cast.moving(delivery_van(white), straight({-80, crossing_m - lane_m, east}, {{0, 1.06}}), 0, 130);
  cast.moving(saloon(blue), straight({82, crossing_m + lane_m, west}, {{0, 1.15}, {76, 1.05}, {110, 0.75}}));
  // Towards the crossing on the arm: the first stops at its line, the second behind it.
  cast.moving(saloon(green),
              straight({-92, crossing_m - lane_m, east}, {{0, 0.30}, {60, 0.86}, {88, 0.85}, {110, 0.0}}));
  cast.moving(wagon(black),
              straight({-109, crossing_m - lane_m, east}, {{0, 0.30}, {60, 0.86}, {96, 0.88}, {116, 0.0}}));
  // Pulls out of a parking place on the arm when the camera has turned.
  cast.moving(small(red),
              drive(Route{{-27, crossing_m + 4.7, west}, {{9, -22 * degree}, {9, 22 * degree}, {0, 0}}}, 0,
                    n_frames, {{112, 0.0}, {126, 0.64}}));
}

void parked(Cast& cast) {
  cast.parked(wagon(blue), {4.75, 11, 0.01});
  cast.parked(saloon(white), {4.80, 17.5, -0.01});
  cast.parked(small(green), {4.75, 27.5, 0.02});
  cast.parked(saloon(black), {-4.80, 9, south});
  cast.parked(small(silver), {-4.75, 21, south + 0.02});
  cast.parked(wagon(white), {-4.80, 27, south - 0.01});
  cast.parked(saloon(red), {4.75, 64, 0.0});
  cast.parked(saloon(silver), {-4.75, 70, south});
  for (const auto& [x_m, z_m, shape] : {std::tuple(-19.0, 4.8, saloon(white)),
                                        {-42.0, 4.75, wagon(silver)},
                                        {-50.0, 4.8, small(blue)},
                                        {-64.0, 4.8, saloon(black)}}) {
    cast.parked(shape, {x_m, crossing_m + z_m, west + 0.01});
  }
  for (const auto& [x_m, z_m, shape] : {std::tuple(-24.0, -4.8, saloon(yellow)),
                                        {-34.5, -4.75, small(white)},
                                        {-46.0, -4.8, wagon(red)},
                                        {-58.0, -4.8, saloon(silver)}}) {
    cast.parked(shape, {x_m, crossing_m + z_m, east - 0.01});
  }
}

}  // namespace

Scenario city() {
  Scenario s;
  StreetPlan plan{.z_to_m = 165, .crossing_z_m = crossing_m, .arm_m = 130, .seed = 21};
  s.world = make_street(plan);
  const Speeds speeds = {{0, 0.60}, {20, 0.66}, {46, 0.62},  {60, 0.0},
                         {73, 0.0}, {84, 0.50}, {108, 0.52}, {125, 0.66}};
  s.T_world_camera = camera_on(drive(ego_route(), 0, n_frames, speeds), 1.0);
  // It stands without a sway.
  for (int k = 61; k <= 73; ++k) s.T_world_camera[k] = s.T_world_camera[60];
  Cast cast(s);
  traffic(cast);
  parked(cast);
  return s;
}

}  // namespace sextant::synthetic
