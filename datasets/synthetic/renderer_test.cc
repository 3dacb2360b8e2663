#include "sextant/datasets/synthetic/renderer.h"

#include <set>

#include "sextant/base/testing.h"
#include "sextant/datasets/synthetic/street.h"

namespace sextant::synthetic {
namespace {

/// A small camera that drives ahead; car 7 crosses the view from left to right in some frames only, van 3
/// stands ahead.
Scenario small_scenario() {
  Scenario s;
  s.name = "small";
  s.camera = {{180, 180, 159.5, 40}, 180 * 0.54};
  s.width = 320;
  s.height = 96;
  s.rate_hz = 5;
  s.world = make_street({.z_to_m = 60, .seed = 3});
  Actor car, van;
  car.id = 7;
  van.id = 3;
  van.type = "Van";
  van.shape = {.length_m = 4.9, .width_m = 1.9, .height_m = 2.0, .van = true};
  const Eigen::Quaterniond to_the_right(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitY()));
  for (int k = 0; k < 6; ++k) {
    s.T_world_camera.push_back(SE3({1, 0, 0, 0}, {1.5, -1.6, 0.5 * k}));
    if (k == 0 || k == 3) {
      car.T_world_object.emplace_back();
    } else {
      car.T_world_object.emplace_back(SE3(to_the_right, {-4.0 + k, 0, 12.0}));
    }
    van.T_world_object.emplace_back(SE3({1, 0, 0, 0}, {3.5, 0, 16.0}));
  }
  s.actors = {car, van};
  return s;
}

std::set<int> ids_of(const Image<uint16_t>& mask) { return {mask.data(), mask.data() + mask.size()}; }

TEST(Renderer, ActorsComeAndGo) {
  const Renderer renderer(small_scenario());
  const SequenceTruth truth = renderer.truth(0, 5);
  for (int k = 0; k < 6; ++k) {
    const bool there = k != 0 && k != 3;
    const Frame frame = renderer.render(k, {.flow = true, .mask = true});
    EXPECT_EQ(ids_of(frame.mask), (there ? std::set{0, 3, 7} : std::set{0, 3})) << k;
    const std::vector<ObjectTruth>& objects = truth.objects.at(k);
    ASSERT_EQ(objects.size(), there ? 2U : 1U) << k;
    EXPECT_EQ(objects.front().id, 3);  // ordered by id
    EXPECT_EQ(truth.find(k, 7) != nullptr, there);
    // The flow of the car is valid if the car exists in both frames.
    if (!there || k == 5) continue;
    const bool there_next = k + 1 != 3;
    for (const auto [x, y] : pixels(frame.mask)) {
      if (frame.mask(x, y) == 7) {
        ASSERT_EQ(frame.flow(x, y).valid(), there_next);
      }
    }
  }
  EXPECT_FALSE(truth.object_motion(7, 2, 3).has_value());
  EXPECT_TRUE(truth.object_motion(7, 1, 2).has_value());
}

TEST(Renderer, TruthNamesSizeAndType) {
  const SequenceTruth truth = Renderer(small_scenario()).truth(1, 1);
  const ObjectTruth* van = truth.find(1, 3);
  ASSERT_NE(van, nullptr);
  EXPECT_EQ(van->type, "Van");
  EXPECT_EQ(*van->size_m, Eigen::Vector3d(1.9, 2.0, 4.9));
  EXPECT_FALSE(*van->moving);
  EXPECT_EQ(truth.find(1, 7)->type, "Car");
  EXPECT_TRUE(*truth.find(1, 7)->moving);
}

TEST(Renderer, CameraAndSizeAreTheScenarios) {
  Scenario s = small_scenario();
  const Frame frame = Renderer(s).render(1, {.rgb = true, .depth = true});
  EXPECT_EQ(frame.rgb.width(), 320);
  EXPECT_EQ(frame.depth_m.height(), 96);
  // A pixel of the road below the camera, whose depth follows from the camera's height.
  EXPECT_NEAR(frame.depth_m(140, 90), 180 * 1.6 / (90 - 40), 1e-4);
}

TEST(Renderer, BadScenariosAreErrors) {
  const auto build = [](auto&& change) {
    return [change] {
      Scenario s = small_scenario();
      change(s);
      Renderer renderer(std::move(s));
    };
  };
  expect_error(build([](Scenario& s) { s.actors[0].id = 3; }), "object id 3 is given twice");
  expect_error(build([](Scenario& s) { s.actors[0].id = 0; }), "object id 0: expected 1..65535");
  expect_error(build([](Scenario& s) { s.actors[1].T_world_object.pop_back(); }),
               "object 3 has 5 poses, the camera 6");
  expect_error(build([](Scenario& s) { s.T_world_camera.clear(); }), "no camera poses");
  expect_error(build([](Scenario& s) { s.height = 0; }), "images of 320x0");
  expect_error(build([](Scenario& s) {
                 s.actors[0].T_world_object[1] = SE3({1, 0, 0, 0}, {NAN, 0, 0});
               }),
               "a pose of object 7 is not finite");
}

}  // namespace
}  // namespace sextant::synthetic
