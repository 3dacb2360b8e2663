#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/kitti_testing.h"
#include "sextant/datasets/rendered_sequence.h"
#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/vdo_folder_testing.h"

namespace sextant {
namespace {

/// Returns the source below SEXTANT_DATA; nullopt if it does not exist.
std::optional<SourceSpec> real(const std::string& adapter, const std::string& folder,
                               const std::string& rest) {
  if (real_data(folder).empty()) return std::nullopt;
  return SourceSpec::parse(adapter + ":" + real_data(folder).string() + rest);
}

TEST(ReplayOnRealData, Vkitti18HasThePapersDistancesBoxesAndAreas) {
  const auto source = real("replay-vkitti1", "vkitti_1.3.1_text", "#0018@124-134");
  if (!source) GTEST_SKIP() << "set SEXTANT_DATA to the folder that holds vkitti_1.3.1_text";
  const auto sequence = open_source(*source);
  EXPECT_EQ(sequence->info().first_frame, 124);
  EXPECT_EQ(sequence->info().last_frame, 134);
  const double expected_percent[] = {6.5, 0.80, 0.35};
  for (int car = 0; car < 3; ++car) {
    const int id = car + 2;  // tid 1, 2, 3
    double area = 0, worst_overlap = 1;
    for (int frame = 124; frame <= 134; ++frame) {
      const Image<uint16_t> mask = sequence->read(frame, {.mask = true}).mask;
      const auto [box, n_pixels] = mask_outlines(mask)[id];
      const ObjectTruth* truth = sequence->truth().find(frame, id);
      ASSERT_NE(truth, nullptr);
      worst_overlap = std::min(worst_overlap, overlap(box, *truth->box));
      area += n_pixels / static_cast<double>(mask.size()) / 11;
    }
    fmt::print("car {}: least IoU {:.3f}, mean area {:.3f} %\n", car + 1, worst_overlap, 100 * area);
    EXPECT_GE(worst_overlap, 0.85) << "car " << car + 1;
    EXPECT_NEAR(100 * area / expected_percent[car], 1.0, 0.2) << "car " << car + 1;
  }
}

/// Expects that flow and depth of a frame agree with the true motions, at both ends of the flow of each
/// body's points.
void expect_flow_of_truth(const Sequence& sequence, int frame) {
  const Frame prev = sequence.read(frame, {.depth = true, .flow = true, .mask = true});
  const PinholeCamera& camera = sequence.info().camera.left;
  std::map<int, int> counts;
  double worst_px = 0;
  for (int y = 0; y < prev.mask.height(); y += 3) {
    for (int x = 0; x < prev.mask.width(); x += 3) {
      const int id = prev.mask(x, y);
      if (!std::isfinite(prev.depth_m(x, y)) || !prev.flow(x, y).valid()) continue;
      const auto motion = id == 0 ? sequence.truth().background_motion(frame, frame + 1)
                                  : sequence.truth().object_motion(id, frame, frame + 1);
      if (!motion) continue;
      const Eigen::Vector2d to = camera.project(*motion * camera.backproject(x, y, prev.depth_m(x, y)));
      worst_px =
          std::max(worst_px, std::hypot(to.x() - x - prev.flow(x, y).u, to.y() - y - prev.flow(x, y).v));
      ++counts[id];
    }
  }
  EXPECT_LT(worst_px, 1e-3);
  EXPECT_GT(counts[0], 10000);
  EXPECT_GT(counts.size(), 1U) << "no object in frame " << frame;
}

TEST(ReplayOnRealData, FlowIsThatOfTheTrueMotions) {
  const auto vkitti = real("replay-vkitti1", "vkitti_1.3.1_text", "#0001@334-343");
  const auto kitti = real("replay-kitti", "kitti_tracking", "#0003@0-20");
  if (!vkitti || !kitti) {
    GTEST_SKIP() << "set SEXTANT_DATA to the folder that holds vkitti_1.3.1_text and kitti_tracking";
  }
  expect_flow_of_truth(*open_source(*vkitti), 336);
  expect_flow_of_truth(*open_source(*kitti), 10);
}

TEST(ReplayOnRealData, MissingFramesAreErrors) {
  const auto source = real("replay-vkitti1", "vkitti_1.3.1_text", "#0018@330-350");
  if (!source) GTEST_SKIP() << "set SEXTANT_DATA to the folder that holds vkitti_1.3.1_text";
  expect_error([&] { open_source(*source); }, "frames 330-350 are requested, but it has frames 0-338");
}

TEST(Replay, AbsentDataAreErrors) {
  const TempFolder folder;
  const std::string path = folder.path().string();
  expect_error([&] { open_source(SourceSpec::parse("replay-vkitti1:" + path + "#0018")); }, path);
  expect_error([&] { open_source(SourceSpec::parse("replay-kitti:" + path + "#0003")); }, path);
}

TEST(Replay, OfKittiHasAnExactTruthWithoutAFloor) {
  const TempFolder folder;
  for (const char* kind : {"calib", "oxts"}) fs::create_directories(folder.path() / "training" / kind);
  write_file(folder.path() / "training/calib/0003.txt", calibration_of_car(200, 80, 24, 100));
  write_file(folder.path() / "training/oxts/0003.txt",
             encode_kitti_oxts(straight_drive({0, 1.1, 2, 3.1})));  // steps of 1.1 m and 0.9 m
  const std::string path = folder.path().string() + "#0003";
  const auto files = open_source(SourceSpec::parse("kitti:" + path));
  EXPECT_NEAR(files->truth().camera_step_floor_m.value(), 0.094, 0.01);
  EXPECT_TRUE(files->info().floor.lateral_m.has_value());
  const auto replay = open_source(SourceSpec::parse("replay-kitti:" + path));
  EXPECT_EQ(replay->truth().camera.poses().size(), 4U);
  EXPECT_FALSE(replay->truth().camera_step_floor_m.has_value());
  EXPECT_FALSE(replay->info().floor.lateral_m.has_value());
  EXPECT_THAT(replay->info().provenance, testing::Contains(testing::HasSubstr("camera truth: oxts")));
  EXPECT_THAT(replay->info().provenance,
              testing::Not(testing::Contains(testing::AnyOf(testing::HasSubstr("camera truth floor"),
                                                            testing::HasSubstr("camera truth heading")))));
}

/// A camera that drives ahead by 1 m per frame, and a car without a size that appears in some frames.
SequenceTruth made_truth() {
  SequenceTruth truth;
  for (int frame = 5; frame < 9; ++frame) {
    truth.camera.set(frame, SE3(Eigen::Quaterniond::Identity(), {1000, 50, 1.0 * frame}));
    ObjectTruth object{.id = 3, .type = "Van"};
    object.T_camera_object = SE3(Eigen::Quaterniond::Identity(), {2, 1.65, 12});
    if (frame != 6) truth.objects[frame] = {object};
  }
  return truth;
}

TEST(ReplayScenario, ActorsAreThereWhereTheirLabelsAre) {
  synthetic::Scenario shape;
  shape.name = "made";
  const synthetic::Scenario scenario = synthetic::replay_scenario(made_truth(), 5, 8, shape);
  ASSERT_EQ(scenario.n_frames(), 4);
  ASSERT_EQ(scenario.actors.size(), 1U);
  const synthetic::Actor& van = scenario.actors[0];
  EXPECT_EQ(van.id, 3);
  EXPECT_TRUE(van.T_world_object[0] && !van.T_world_object[1] && van.T_world_object[2]);
  EXPECT_NEAR(van.shape.height_m, 2.2, 1e-12);  // the default size of a van
  EXPECT_TRUE(van.moves(2));
  const SE3 T = scenario.T_world_camera[2].inverse() * *van.T_world_object[2];
  EXPECT_LT((T.translation() - Eigen::Vector3d(2, 1.65, 12)).norm(), 1e-12);
  scenario.check();
}

TEST(ReplayScenario, RefusesAWorldThatIsNotUpright) {
  SequenceTruth truth = made_truth();
  const SE3 tilt(Eigen::Quaterniond(Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX())), {0, 0, 0});
  SequenceTruth turned;
  for (const auto& [frame, pose] : truth.camera.poses()) turned.camera.set(frame, tilt * pose);
  synthetic::Scenario shape;
  shape.name = "made";
  expect_error([&] { synthetic::replay_scenario(turned, 5, 8, shape); }, "down axis");
  expect_error([&] { synthetic::replay_scenario(truth, 4, 8, shape); }, "frame 4 has no camera pose");
}

}  // namespace

}  // namespace sextant
