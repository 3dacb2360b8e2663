#include <cmath>

#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

constexpr double crossing_m = 30;

StreetPlan crossroads(uint32_t seed) {
  StreetPlan plan{.z_to_m = 120, .crossing_z_m = crossing_m, .seed = seed};
  return plan;
}

}  // namespace

Scenario s18() {
  Scenario s;
  s.world = make_street({.z_to_m = 170, .seed = 18});
  const auto ego = drive({1.75, 0, 0.004}, 11, [](int k) {
    return Advance{0.605 + 0.065 * std::sin(0.7 * k + 0.5), 0.0015 * std::cos(0.5 * k)};
  });
  s.T_world_camera = camera_on(ego, 1.0);
  Cast cast(s);
  cast.moving(CarShape{red, 3.55, 1.52, 1.34}, {-1.65, 7.75, 0.01}, [](int k) {
    return Advance{0.66 + 0.03 * std::sin(0.8 * k), 0.004 * std::sin(0.6 * k)};
  });
  cast.moving(CarShape{silver, 4.1, 1.64, 1.38, true}, {1.60, 17.6, -0.01}, [](int k) {
    return Advance{0.64 + 0.05 * std::sin(0.5 * k + 2), 0.003 * std::cos(0.7 * k)};
  });
  cast.moving(CarShape{yellow, 3.6, 1.56, 1.36, true}, {-1.70, 25.8, 0.0}, [](int k) {
    return Advance{0.67 - 0.006 * k, -0.004 * std::sin(0.4 * k + 1)};
  });
  cast.parked(wagon(blue), {4.75, 15.5, 0.01});
  cast.parked(saloon(white), {4.80, 21.6, -0.01});
  cast.parked(small(green), {-4.80, 22.5, std::numbers::pi});
  cast.parked(saloon(black), {-4.75, 34.0, std::numbers::pi + 0.02});
  cast.parked(saloon(silver), {4.75, 36.5, 0.0});
  return s;
}

Scenario s01_turn() {
  Scenario s;
  s.world = make_street(crossroads(11));
  const auto ego = drive({1.0, crossing_m - 8.5, -25 * degree}, 16, [](int k) {
    return Advance{0.73 - 0.19 * k / 14.0, -(2.6 - 1.1 * k / 14.0) * degree};
  });
  s.T_world_camera = camera_on(ego, 0.7);
  Cast cast(s);
  cast.moving(saloon(red), {-7.0, crossing_m + 1.9, -82 * degree}, [](int k) {
    return Advance{0.66 - 0.004 * k, -(0.9 - 0.05 * k) * degree};
  });
  cast.parked(wagon(blue), {-15.0, crossing_m + 4.8, -90 * degree});
  cast.parked(small(white), {-21.5, crossing_m + 4.8, -91 * degree});
  cast.parked(saloon(green), {-17.5, crossing_m - 4.8, 90 * degree});
  return s;
}

Scenario s01_crossing() {
  Scenario s;
  s.world = make_street(crossroads(12));
  s.T_world_camera = camera_on(std::vector<Stance>(12, {1.75, crossing_m - 14.5, 0.02}), 0.0);
  Cast cast(s);
  cast.moving(wagon(blue), {1.5, crossing_m - 2.2, -12 * degree}, [](int k) {
    return Advance{0.42 + 0.015 * k, -(4.8 + 0.3 * k) * degree};
  });
  cast.parked(saloon(red), {-12.0, crossing_m + 4.8, -90 * degree});
  cast.parked(small(white), {-4.8, crossing_m + 16.0, std::numbers::pi});
  cast.parked(saloon(silver), {4.8, crossing_m + 14.0, 0.0});
  return s;
}

}  // namespace sextant::synthetic
