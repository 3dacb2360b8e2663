#include "sextant/datasets/synthetic/scenario.h"

#include <cmath>
#include <functional>
#include <set>
#include <span>

#include "sextant/base/names.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

constexpr double paper_crossing_m = 30;

StreetPlan crossroads(uint32_t seed) {
  return {.z_to_m = 120, .crossing_z_m = paper_crossing_m, .seed = seed};
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
  const auto ego = drive({1.0, paper_crossing_m - 8.5, -25 * degree}, 16, [](int k) {
    return Advance{0.73 - 0.19 * k / 14.0, -(2.6 - 1.1 * k / 14.0) * degree};
  });
  s.T_world_camera = camera_on(ego, 0.7);
  Cast cast(s);
  cast.moving(saloon(red), {-7.0, paper_crossing_m + 1.9, -82 * degree}, [](int k) {
    return Advance{0.66 - 0.004 * k, -(0.9 - 0.05 * k) * degree};
  });
  cast.parked(wagon(blue), {-15.0, paper_crossing_m + 4.8, -90 * degree});
  cast.parked(small(white), {-21.5, paper_crossing_m + 4.8, -91 * degree});
  cast.parked(saloon(green), {-17.5, paper_crossing_m - 4.8, 90 * degree});
  return s;
}

Scenario s01_crossing() {
  Scenario s;
  s.world = make_street(crossroads(12));
  s.T_world_camera = camera_on(std::vector<Stance>(12, {1.75, paper_crossing_m - 14.5, 0.02}), 0.0);
  Cast cast(s);
  cast.moving(wagon(blue), {1.5, paper_crossing_m - 2.2, -12 * degree}, [](int k) {
    return Advance{0.42 + 0.015 * k, -(4.8 + 0.3 * k) * degree};
  });
  cast.parked(saloon(red), {-12.0, paper_crossing_m + 4.8, -90 * degree});
  cast.parked(small(white), {-4.8, paper_crossing_m + 16.0, std::numbers::pi});
  cast.parked(saloon(silver), {4.8, paper_crossing_m + 14.0, 0.0});
  return s;
}

namespace {

constexpr double city_crossing_m = 46;
constexpr double city_lane_m = 1.75;  // distance from the middle of the road to the middle of a lane
constexpr int city_n_frames = 160;
constexpr double north = 0, south = 180 * degree, east = 90 * degree, west = -90 * degree;

/// Along the street in the right lane, left at the crossing, along the arm in the right lane.
Route ego_route() {
  const double radius_m = 9;
  return {{city_lane_m, 0, north},
          {{city_crossing_m + city_lane_m - radius_m, 0}, {radius_m * 90 * degree, -90 * degree}, {0, 0}}};
}

std::vector<Stance> straight(const Stance& start, const Speeds& speeds) {
  return drive(Route{start, {{0, 0}}}, 0, city_n_frames, speeds);
}

void traffic(Cast& cast) {
  // Ahead in the own lane, without stopping.
  cast.moving(saloon(silver), straight({city_lane_m, 13, north}, {{0, 0.64}, {40, 0.60}, {60, 0.85}}));
  // Oncoming: the red car passes before the camera stops, the yellow one when it starts again.
  cast.moving(wagon(red), straight({-city_lane_m, 62, south}, {{0, 0.80}, {50, 0.85}}), 0, 75);
  cast.moving(small(yellow), straight({-city_lane_m, 112, south}, {{0, 1.10}, {70, 1.02}}), 0, 110);
  // Across the street while the camera stands.
  cast.moving(delivery_van(white), straight({-80, city_crossing_m - city_lane_m, east}, {{0, 1.06}}), 0, 130);
  cast.moving(saloon(blue),
              straight({82, city_crossing_m + city_lane_m, west}, {{0, 1.15}, {76, 1.05}, {110, 0.75}}));
  // Approaching the crossing on the arm: the first stops at its line, the second behind it.
  cast.moving(saloon(green), straight({-92, city_crossing_m - city_lane_m, east},
                                      {{0, 0.30}, {60, 0.86}, {88, 0.85}, {110, 0.0}}));
  cast.moving(wagon(black), straight({-109, city_crossing_m - city_lane_m, east},
                                     {{0, 0.30}, {60, 0.86}, {96, 0.88}, {116, 0.0}}));
  // Pulls out of a parking space on the arm after the camera has turned.
  cast.moving(small(red),
              drive(Route{{-27, city_crossing_m + 4.7, west}, {{9, -22 * degree}, {9, 22 * degree}, {0, 0}}},
                    0, city_n_frames, {{112, 0.0}, {126, 0.64}}));
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
    cast.parked(shape, {x_m, city_crossing_m + z_m, west + 0.01});
  }
  for (const auto& [x_m, z_m, shape] : {std::tuple(-24.0, -4.8, saloon(yellow)),
                                        {-34.5, -4.75, small(white)},
                                        {-46.0, -4.8, wagon(red)},
                                        {-58.0, -4.8, saloon(silver)}}) {
    cast.parked(shape, {x_m, city_crossing_m + z_m, east - 0.01});
  }
}

}  // namespace

Scenario city() {
  Scenario s;
  StreetPlan plan{.z_to_m = 165, .crossing_z_m = city_crossing_m, .arm_m = 130, .seed = 21};
  s.world = make_street(plan);
  const Speeds speeds = {{0, 0.60}, {20, 0.66}, {46, 0.62},  {60, 0.0},
                         {73, 0.0}, {84, 0.50}, {108, 0.52}, {125, 0.66}};
  s.T_world_camera = camera_on(drive(ego_route(), 0, city_n_frames, speeds), 1.0);
  // The camera stands without swaying.
  for (int k = 61; k <= 73; ++k) s.T_world_camera[k] = s.T_world_camera[60];
  Cast cast(s);
  traffic(cast);
  parked(cast);
  return s;
}

namespace {

using Eigen::Vector3d;

constexpr int highway_n_frames = 40;
constexpr double highway_lane_m = 3.6;
constexpr double from_m = -60, to_m = 320;
const Eigen::Vector3f asphalt_grey(0.36F, 0.36F, 0.37F), concrete_grey(0.58F, 0.57F, 0.54F),
    meadow(0.30F, 0.36F, 0.20F);

/// Three lanes in each direction, a concrete barrier between them, guard rails, noise walls and trees
/// outside.
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
  /// Adds dashes between the lanes, and solid lines at the edges.
  void carriageway(double middle_x) {
    const double edge = 1.5 * highway_lane_m;
    for (const double line : {-0.5 * highway_lane_m, 0.5 * highway_lane_m}) {
      const Look dashed{Material::road, asphalt_grey, 101, 100};
      strip(dashed, middle_x + line - 0.5 * highway_lane_m, middle_x + line + 0.5 * highway_lane_m, 0,
            middle_x + line);
    }
    for (const double side : {-1.0, 1.0}) {
      const Look solid{Material::road, asphalt_grey, 101, 50};
      const double inner = middle_x + side * highway_lane_m, outer = middle_x + side * (edge + 2.3);
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
  /// Adds panels of several tints between posts.
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

/// Adds a car in a lane (-1 left, 0 the camera's, 1 right), with small variations of speed.
void car(Cast& cast, const CarShape& shape, double lane, double z_m, double step_m, double phase,
         double heading_rad = 0) {
  const double x_m = lane * highway_lane_m;
  cast.moving(shape, {x_m, z_m, heading_rad}, [=](int k) {
    return Advance{step_m + 0.03 * std::sin(0.35 * k + phase), 0.0015 * std::cos(0.3 * k + phase)};
  });
}

}  // namespace

Scenario highway() {
  Scenario s;
  s.world = Motorway().build();
  s.T_world_camera =
      camera_on(drive({0, 0, 0}, highway_n_frames,
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
  // Oncoming traffic beyond the barrier.
  car(cast, saloon(green), -4.0, 55, 2.2, 0.5, std::numbers::pi);
  car(cast, delivery_van(yellow), -5.0, 95, 2.3, 1.5, std::numbers::pi);
  return s;
}

namespace {

constexpr int drive_n_frames = 30;
constexpr double drive_lane_m = 1.75;

/// Bends to the right, then to the left.
Route route() { return {{0, 0, 0}, {{14, 0}, {24, 22 * degree}, {10, 0}, {26, -26 * degree}, {0, 0}}}; }

/// Returns the stance `right_m` to the right of the route.
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
  const auto ego = drive(route(), 0, drive_n_frames, {{0, 0.78}, {12, 0.92}, {20, 0.86}, {30, 0.95}});
  s.T_world_camera = camera_on(ego, 0.8);
  Cast cast(s);
  cast.moving(saloon(red), drive(route(), 11.5, drive_n_frames, {{0, 0.80}, {12, 0.88}, {22, 0.93}}));
  std::vector<Stance> oncoming;
  for (int k = 0; k < drive_n_frames; ++k)
    oncoming.push_back(beside(47 - 0.85 * k, -2 * drive_lane_m, 180 * degree));
  cast.moving(small(yellow), oncoming);
  std::vector<Stance> second;
  for (int k = 0; k < drive_n_frames; ++k)
    second.push_back(beside(71 - 0.8 * k, -2 * drive_lane_m, 180 * degree));
  cast.moving(delivery_van(white), second);
  cast.parked(wagon(blue), beside(13, 3.0));
  cast.parked(saloon(silver), beside(21, 3.0, 0.02));
  cast.parked(small(green), beside(37, 3.05));
  cast.parked(saloon(black), beside(17, -6.4, 180 * degree));
  cast.parked(wagon(white), beside(30, -6.4, 181 * degree));

  StreetWay way{.clearance_m = 2.6, .seed = 41};
  for (double at_m = 0; at_m <= 85; at_m += 1.0) {
    const Stance middle = beside(at_m, -drive_lane_m);
    way.points.push_back(
        {{middle.x_m, 0, middle.z_m}, {std::sin(middle.heading_rad), 0, std::cos(middle.heading_rad)}});
  }
  way.dashes_m = 0;
  s.world = make_street_along(way);
  return s;
}

namespace {

struct Entry {
  std::string name;
  std::function<Scenario()> make;
};

std::span<const Entry> entries() {
  static const std::vector<Entry> table = {
      {"s18", s18},   {"s01-turn", s01_turn}, {"s01-crossing", s01_crossing},
      {"city", city}, {"highway", highway},   {"stereo-drive", stereo_drive}};
  return table;
}

/// Returns the step length (m); nullopt if the actor is absent in one of the frames.
std::optional<double> step_length_m(const Actor& actor, int from, int to) {
  const int n = static_cast<int>(actor.T_world_object.size());
  if (from < 0 || to >= n) return std::nullopt;
  const auto& before = actor.T_world_object[static_cast<size_t>(from)];
  const auto& after = actor.T_world_object[static_cast<size_t>(to)];
  if (!before || !after) return std::nullopt;
  return (after->translation() - before->translation()).norm();
}

}  // namespace

bool Actor::moves(int frame) const {
  const auto ahead = step_length_m(*this, frame, frame + 1);
  return (ahead ? *ahead : step_length_m(*this, frame - 1, frame).value_or(0)) >= moving_step_m;
}

Scenario make_scenario(const std::string& name) {
  Scenario scenario = find_entry(entries(), name, "scenario").make();
  scenario.name = name;
  return scenario;
}

Scenario every_nth_frame(Scenario scenario, int n) {
  if (n == 1) return scenario;
  if (n < 1 || scenario.n_frames() <= n)
    fail("scenario '{}': every = {} with {} frames: expected 1 to {}, which leaves two or more",
         scenario.name, n, scenario.n_frames(), scenario.n_frames() - 1);
  const auto thin_out = [n](auto& per_frame) {
    size_t kept = 0;
    for (size_t frame = 0; frame < per_frame.size(); frame += static_cast<size_t>(n))
      per_frame[kept++] = per_frame[frame];
    per_frame.resize(kept);
  };
  thin_out(scenario.T_world_camera);
  for (Actor& actor : scenario.actors) thin_out(actor.T_world_object);
  scenario.rate_hz /= n;
  scenario.name += fmt::format("/every{}", n);
  return scenario;
}

std::vector<std::string> scenario_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries()) names.push_back(entry.name);
  return names;
}

void Scenario::check() const {
  camera.check();
  if (width <= 0 || height <= 0 || !(rate_hz > 0)) {
    fail("scenario '{}': images of {}x{} at {} Hz: expected positive numbers", name, width, height, rate_hz);
  }
  if (T_world_camera.empty()) fail("scenario '{}': it has no camera poses", name);
  for (const SE3& pose : T_world_camera) {
    if (!pose.is_finite()) fail("scenario '{}': a camera pose is not finite", name);
  }
  std::set<int> ids;
  for (const Actor& actor : actors) {
    if (actor.id < 1 || actor.id > 65535) {
      fail("scenario '{}': object id {}: expected 1..65535, which masks can hold", name, actor.id);
    }
    if (!ids.insert(actor.id).second) fail("scenario '{}': object id {} is given twice", name, actor.id);
    if (actor.T_world_object.size() != T_world_camera.size()) {
      fail("scenario '{}': object {} has {} poses, the camera {}: expected one per frame", name, actor.id,
           actor.T_world_object.size(), T_world_camera.size());
    }
    for (const auto& pose : actor.T_world_object) {
      if (pose && !pose->is_finite())
        fail("scenario '{}': a pose of object {} is not finite", name, actor.id);
    }
  }
}

}  // namespace sextant::synthetic
