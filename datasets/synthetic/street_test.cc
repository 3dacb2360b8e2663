#include <cmath>

#include "sextant/base/testing.h"
#include "sextant/datasets/synthetic/renderer.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

/// A path up and down a hill, through a narrow left bend.
struct Ride {
  Scenario scenario;
  StreetWay way;
};

Ride hilly_ride() {
  Ride ride;
  double heading_rad = 0;
  Vector3d ground(0, 0, 0);
  for (int k = 0; k < 90; ++k) {
    const Vector3d ahead(std::sin(heading_rad), 0, std::cos(heading_rad));
    if (k < 40 || k > 45) ground += ahead;  // it stands for a while
    ground.y() = -2 * std::sin(0.03 * k);
    if (k > 45 && k < 80) heading_rad -= 0.05;
    ride.way.points.push_back({ground, ahead});
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(heading_rad, Vector3d::UnitY()));
    ride.scenario.T_world_camera.emplace_back(turned, ground - Vector3d(0, 1.6, 0));
  }
  ride.scenario.name = "ride";
  ride.scenario.camera = {{180, 180, 159.5, 20}, 100};
  ride.scenario.width = 320;
  ride.scenario.height = 96;
  return ride;
}

TEST(StreetAlong, TheWayIsOpenAndTheGroundBelowIt) {
  Ride ride = hilly_ride();
  ride.scenario.world = make_street_along(ride.way);
  const Renderer renderer(ride.scenario);
  for (int k = 0; k < 90; k += 6) {
    const Frame frame = renderer.render(k, {.depth = true});
    for (const auto [x, y] : PixelRange(320, 96)) {
      const double depth_m = frame.depth_m(x, y);
      if (std::isnan(depth_m)) continue;
      // Only the ground comes near the camera, and the ground never rises towards it.
      const Vector3d p = ride.scenario.camera.left.backproject(x, y, depth_m);
      if (p.norm() < 3.5) {
        EXPECT_NEAR(p.y(), 1.62, 0.25) << "frame " << k << " at " << x << " " << y;
      }
    }
    // Ahead, the road follows the path: it differs by at most half a metre from the path's own height.
    EXPECT_NEAR(ride.scenario.camera.left.backproject(159, 95, frame.depth_m(159, 95)).y(), 1.62, 0.35) << k;
  }
}

TEST(StreetAlong, ObjectsAreSeenAlongSightLinesAndNothingStandsInThem) {
  // A car stands well off the road, where houses would be.
  Ride ride = hilly_ride();
  Actor car;
  car.id = 1;
  const Vector3d place(16, 0, 30);
  car.T_world_object.assign(90, SE3({1, 0, 0, 0}, place));
  ride.scenario.actors = {car};
  const auto seen_px = [&] {
    ride.scenario.world = make_street_along(ride.way);
    const Frame frame = Renderer(ride.scenario).render(2, {.mask = true});
    return std::count(frame.mask.data(), frame.mask.data() + frame.mask.size(), 1);
  };
  EXPECT_EQ(seen_px(), 0);
  for (const double dx : {-2.5, 0.0, 2.5}) ride.way.keep_free.push_back(place + Vector3d(dx, 0, 0));
  for (const Vector3d& end : ride.way.keep_free) ride.way.sight.push_back({ride.way.points[2].ground, end});
  EXPECT_GT(seen_px(), 40);
  // Its wheels stand on the ground.
  ride.scenario.T_world_camera[0] = SE3({1, 0, 0, 0}, place + Vector3d(0, -1.6, -6));
  ride.scenario.actors[0].T_world_object[0].reset();
  const Frame frame = Renderer(ride.scenario).render(0, {.depth = true});
  EXPECT_NEAR(ride.scenario.camera.left.backproject(159, 68, frame.depth_m(159, 68)).y(), 1.62, 0.15);
}

TEST(StreetAlong, SameSeedSameMesh) {
  const Ride ride = hilly_ride();
  const Mesh a = make_street_along(ride.way), b = make_street_along(ride.way);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  EXPECT_EQ(a.vertices, b.vertices);
}

TEST(StreetAlong, BadWaysAreErrors) {
  expect_error([] { make_street_along({}); }, "the path has no points");
  expect_error(
      [] {
        make_street_along({.points = {{{0, 0, 0}, {0, 1, 0}}}});
      },
      "the direction has no horizontal component");
  expect_error(
      [] {
        make_street_along({.points = {{{0, 0, 0}, {0, 0, 1}}, {{9e9, 0, 0}, {0, 0, 1}}}});
      },
      "expected at most 1 km");
}

}  // namespace

}  // namespace sextant::synthetic
