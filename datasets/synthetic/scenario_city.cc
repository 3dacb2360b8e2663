#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

constexpr double kCrossing_m = 46;
constexpr double kLane_m = 1.75;  // middle of a lane from the middle of the road
constexpr int kFrames = 160;
constexpr double kNorth = 0, kSouth = 180 * kDegree, kEast = 90 * kDegree, kWest = -90 * kDegree;

/// Up the street in the right lane, left at the crossing, down the arm in the right lane.
Route ego_route() {
  const double radius_m = 9;
  return {{kLane_m, 0, kNorth},
          {{kCrossing_m + kLane_m - radius_m, 0}, {radius_m * 90 * kDegree, -90 * kDegree}, {0, 0}}};
}

std::vector<Stance> straight(const Stance& start, const Speeds& speeds) {
  return drive(Route{start, {{0, 0}}}, 0, kFrames, speeds);
}

void traffic(Cast& cast) {
  // Ahead in the own lane; it does not stop.
  cast.moving(saloon(kSilver), straight({kLane_m, 13, kNorth}, {{0, 0.64}, {40, 0.60}, {60, 0.85}}));
  // Coming towards the camera: one passes on the street, one while it stands, one later behind it.
  cast.moving(wagon(kRed), straight({-kLane_m, 62, kSouth}, {{0, 0.80}, {50, 0.85}}), 0, 75);
  cast.moving(small(kYellow), straight({-kLane_m, 112, kSouth}, {{0, 1.10}, {70, 1.02}}), 0, 110);
  // Across the street while the camera stands.
  cast.moving(delivery_van(kWhite), straight({-80, kCrossing_m - kLane_m, kEast}, {{0, 1.06}}), 0, 130);
  cast.moving(saloon(kBlue),
              straight({82, kCrossing_m + kLane_m, kWest}, {{0, 1.15}, {76, 1.05}, {110, 0.75}}));
  // Towards the crossing on the arm: the first stops at its line, the second behind it.
  cast.moving(saloon(kGreen),
              straight({-92, kCrossing_m - kLane_m, kEast}, {{0, 0.30}, {60, 0.86}, {88, 0.85}, {110, 0.0}}));
  cast.moving(wagon(kBlack), straight({-109, kCrossing_m - kLane_m, kEast},
                                      {{0, 0.30}, {60, 0.86}, {96, 0.88}, {116, 0.0}}));
  // Pulls out of a parking place on the arm when the camera has turned.
  cast.moving(small(kRed),
              drive(Route{{-27, kCrossing_m + 4.7, kWest}, {{9, -22 * kDegree}, {9, 22 * kDegree}, {0, 0}}},
                    0, kFrames, {{112, 0.0}, {126, 0.64}}));
}

void parked(Cast& cast) {
  cast.parked(wagon(kBlue), {4.75, 11, 0.01});
  cast.parked(saloon(kWhite), {4.80, 17.5, -0.01});
  cast.parked(small(kGreen), {4.75, 27.5, 0.02});
  cast.parked(saloon(kBlack), {-4.80, 9, kSouth});
  cast.parked(small(kSilver), {-4.75, 21, kSouth + 0.02});
  cast.parked(wagon(kWhite), {-4.80, 27, kSouth - 0.01});
  cast.parked(saloon(kRed), {4.75, 64, 0.0});
  cast.parked(saloon(kSilver), {-4.75, 70, kSouth});
  for (const auto& [x_m, z_m, shape] : {std::tuple(-19.0, 4.8, saloon(kWhite)),
                                        {-42.0, 4.75, wagon(kSilver)},
                                        {-50.0, 4.8, small(kBlue)},
                                        {-64.0, 4.8, saloon(kBlack)}}) {
    cast.parked(shape, {x_m, kCrossing_m + z_m, kWest + 0.01});
  }
  for (const auto& [x_m, z_m, shape] : {std::tuple(-24.0, -4.8, saloon(kYellow)),
                                        {-34.5, -4.75, small(kWhite)},
                                        {-46.0, -4.8, wagon(kRed)},
                                        {-58.0, -4.8, saloon(kSilver)}}) {
    cast.parked(shape, {x_m, kCrossing_m + z_m, kEast - 0.01});
  }
}

}  // namespace

Scenario city() {
  Scenario s;
  StreetPlan plan;
  plan.z_to_m = 165;
  plan.crossing_z_m = kCrossing_m;
  plan.arm_m = 130;
  plan.seed = 21;
  s.world = make_street(plan);
  const Speeds speeds = {{0, 0.60}, {20, 0.66}, {46, 0.62},  {60, 0.0},
                         {73, 0.0}, {84, 0.50}, {108, 0.52}, {125, 0.66}};
  s.T_world_camera = camera_on(drive(ego_route(), 0, kFrames, speeds), 1.0);
  // It stands without a sway.
  for (int k = 61; k <= 73; ++k) s.T_world_camera[k] = s.T_world_camera[60];
  Cast cast(s);
  traffic(cast);
  parked(cast);
  return s;
}

}  // namespace sextant::synthetic
