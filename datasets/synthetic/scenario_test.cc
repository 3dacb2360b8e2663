// Content of the scenarios: stops, entries and exits, coverage; cars do not intersect.

#include "sextant/datasets/synthetic/scenario.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/datasets/synthetic/renderer.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector2d;

/// A car in bird's eye view.
struct Footprint2d {
  Vector2d middle, ahead;
  double half_length_m, half_width_m;

  /// Returns the largest gap between the two along any of this one's axes; > 0 means that they are disjoint.
  double gap_along_own_axes(const Footprint2d& other) const {
    double gap = -1e9;
    for (const auto& [axis, half] :
         {std::pair(ahead, half_length_m), {Vector2d(ahead.y(), -ahead.x()), half_width_m}}) {
      const double reach =
          other.half_length_m * std::abs(other.ahead.dot(axis)) +
          other.half_width_m * std::abs(Vector2d(other.ahead.y(), -other.ahead.x()).dot(axis));
      gap = std::max(gap, std::abs((other.middle - middle).dot(axis)) - half - reach);
    }
    return gap;
  }
  double gap_m(const Footprint2d& other) const {
    return std::max(gap_along_own_axes(other), other.gap_along_own_axes(*this));
  }
};

Footprint2d footprint(const SE3& pose, double length_m, double width_m) {
  const Eigen::Vector3d ahead = pose.rotation() * Eigen::Vector3d::UnitZ();
  return {{pose.translation().x(), pose.translation().z()},
          Vector2d(ahead.x(), ahead.z()).normalized(),
          length_m / 2,
          width_m / 2};
}

TEST(Scenario, NoCarDrivesThroughAnother) {
  for (const std::string& name : scenario_names()) {
    const Scenario s = make_scenario(name);
    for (int k = 0; k < s.n_frames(); ++k) {
      // The camera's own car extends 2 m behind and 1.6 m ahead of the camera.
      std::vector<Footprint2d> cars = {footprint(s.T_world_camera[k], 3.2, 1.7)};
      std::vector<int> ids = {0};
      for (const Actor& actor : s.actors) {
        if (!actor.T_world_object[k]) continue;
        ids.push_back(actor.id);
        cars.push_back(footprint(*actor.T_world_object[k], actor.shape.length_m, actor.shape.width_m));
      }
      for (size_t i = 0; i < cars.size(); ++i) {
        for (size_t j = 0; j < i; ++j) {
          EXPECT_GT(cars[i].gap_m(cars[j]), 0.1)
              << name << " frame " << k << ": " << ids[j] << " and " << ids[i];
        }
      }
    }
  }
}

TEST(Scenario, CityHasStopsTurnsAndParkedCars) {
  const Scenario s = make_scenario("city");
  EXPECT_GE(s.n_frames(), 150);
  int standing = 0, longest_stop = 0;
  double turned_rad = 0;
  for (int k = 1; k < s.n_frames(); ++k) {
    const SE3 step = s.T_world_camera[k - 1].inverse() * s.T_world_camera[k];
    standing = step.translation().norm() == 0 ? standing + 1 : 0;
    longest_stop = std::max(longest_stop, standing);
    turned_rad += rotation_angle_rad(step.rotation());
    EXPECT_LT(step.translation().norm(), 0.75);
  }
  EXPECT_GE(longest_stop, 8);
  EXPECT_GT(turned_rad, 1.4);
  // Cars that stop, and one that starts.
  int n_stop = 0, n_start = 0, n_parked = 0, n_moving = 0;
  for (const Actor& actor : s.actors) {
    std::vector<bool> stands;
    for (size_t k = 1; k < actor.T_world_object.size(); ++k) {
      if (!actor.T_world_object[k] || !actor.T_world_object[k - 1]) continue;
      stands.push_back(
          (actor.T_world_object[k]->translation() - actor.T_world_object[k - 1]->translation()).norm() == 0);
    }
    if (std::ranges::count(stands, false) == 0) {
      ++n_parked;
      continue;
    }
    ++n_moving;
    n_stop += !stands.front() && stands.back() ? 1 : 0;
    n_start += stands.front() && !stands.back() ? 1 : 0;
  }
  EXPECT_GE(n_stop, 2);
  EXPECT_GE(n_start, 1);
  EXPECT_GE(n_parked, 8);
  EXPECT_GE(n_moving, 6);
}

TEST(Scenario, CityCarsEnterLeaveAndHideOneAnother) {
  const Renderer renderer(make_scenario("city"));
  const SequenceTruth truth = renderer.truth(0, 159);
  const double width = renderer.scenario().width;
  std::map<int, std::vector<int>> frames;
  int n_cut_by_the_border = 0;
  for (const auto& [k, objects] : truth.objects) {
    for (const ObjectTruth& object : objects) {
      frames[object.id].push_back(k);
      n_cut_by_the_border += object.box->left == 0 || object.box->right == width - 1 ? 1 : 0;
    }
  }
  int n_enter = 0, n_leave = 0, n_gone_for_a_while = 0;
  for (const auto& [id, seen] : frames) {
    n_enter += seen.front() > 0 ? 1 : 0;
    n_leave += seen.back() < 159 ? 1 : 0;
    n_gone_for_a_while += seen.back() - seen.front() + 1 > static_cast<int>(seen.size()) ? 1 : 0;
  }
  EXPECT_GE(n_enter, 6);
  EXPECT_GE(n_leave, 10);
  EXPECT_GE(n_gone_for_a_while, 2);  // hidden, then visible again
  EXPECT_GE(n_cut_by_the_border, 30);
  RecordProperty("enter", n_enter);
  RecordProperty("leave", n_leave);
  RecordProperty("hidden_for_a_while", n_gone_for_a_while);
  RecordProperty("cut_by_the_border", n_cut_by_the_border);
  // Pixels of cars that are occluded in the next frame: what is visible there is at least 0.5 m nearer.
  const Scenario& city = renderer.scenario();
  int n_hidden_px = 0;
  for (int k = 30; k <= 150; k += 20) {
    const Frame frame = renderer.render(k, {.depth = true, .flow = true, .mask = true});
    const Frame next = renderer.render(k + 1, {.depth = true, .mask = true});
    for (const auto [x, y] : pixels(frame.mask)) {
      const int id = frame.mask(x, y);
      const TargetPixel target =
          target_pixel(x, y, frame.flow(x, y), frame.mask.width(), frame.mask.height());
      if (id == 0 || !target.inside || next.mask(target.x, target.y) == id) continue;
      const auto& poses = city.actors[static_cast<size_t>(id) - 1].T_world_object;
      if (!poses[k + 1]) continue;
      const SE3 motion =
          city.T_world_camera[k + 1].inverse() * *poses[k + 1] * poses[k]->inverse() * city.T_world_camera[k];
      const Eigen::Vector3d at = city.camera.left.backproject(x, y, frame.depth_m(x, y));
      n_hidden_px += next.depth_m(target.x, target.y) < (motion * at).z() - 0.5 ? 1 : 0;
    }
  }
  EXPECT_GT(n_hidden_px, 500);
  RecordProperty("hidden_car_pixels", n_hidden_px);
}

TEST(Scenario, HighwayIsCoveredByMovingCars) {
  const Renderer renderer(make_scenario("highway"));
  const Scenario& s = renderer.scenario();
  double mean_image = 0, mean_below = 0;
  int n = 0;
  for (int k = 0; k < s.n_frames(); k += 6, ++n) {
    const Frame frame = renderer.render(k, {.mask = true});
    const int horizon = static_cast<int>(s.camera.left.cy);
    double covered = 0, covered_below = 0;
    for (const auto [x, y] : PixelRange(s.width, s.height)) {
      covered += frame.mask(x, y) != 0 ? 1 : 0;
      covered_below += frame.mask(x, y) != 0 && y > horizon ? 1 : 0;
    }
    mean_image += covered / (s.width * s.height);
    mean_below += covered_below / (s.width * (s.height - horizon - 1));
  }
  for (const Actor& actor : s.actors) EXPECT_TRUE(actor.moves(0) || actor.moves(s.n_frames() - 1));
  EXPECT_GT(mean_image / n, 0.45);
  EXPECT_GT(mean_below / n, 0.60);
  RecordProperty("of_the_image", fmt::format("{:.3f}", mean_image / n));
  RecordProperty("below_the_horizon", fmt::format("{:.3f}", mean_below / n));
}

TEST(Scenario, StereoDriveHasTheCameraOfKitti) {
  const Scenario s = make_scenario("stereo-drive");
  EXPECT_EQ(s.camera.left.fx, 721.5377);
  EXPECT_EQ(s.camera.left.cx, 609.5593);
  EXPECT_EQ(s.camera.left.cy, 172.854);
  EXPECT_EQ(s.camera.bf, 384.38);
  EXPECT_GE(s.n_frames(), 20);
  EXPECT_LE(s.n_frames(), 40);
}

}  // namespace
}  // namespace sextant::synthetic
