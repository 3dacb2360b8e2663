#include "sextant/datasets/vkitti_layout.h"

#include <algorithm>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/vkitti_testing.h"

namespace sextant {
namespace {

constexpr Channels measured_channels{.depth = true, .flow = true, .mask = true};

class VkittiLayouts : public testing::TestWithParam<const char*> {
 protected:
  std::string write(const Sequence& sequence, const std::string& name = "", int jobs = 2) const {
    LayoutRequest request{.out = temp_.path() / "D", .sequence = name, .jobs = jobs, .quiet = true};
    return find_layout(GetParam()).write(sequence, request);
  }
  bool first() const { return std::string(GetParam()) == "vkitti1"; }
  TempFolder temp_;
};

void expect_same_truth(const Sequence& source, const Sequence& read, bool boxes, bool moving) {
  for (int k = source.info().first_frame; k <= source.info().last_frame; ++k) {
    ASSERT_TRUE(read.truth().camera.has(k));
    EXPECT_LT((read.truth().camera.pose(k)->inverse() * *source.truth().camera.pose(k)).log().norm(), 1e-9);
    const auto& expected = source.truth().objects.at(k);
    const auto& got = read.truth().objects.at(k);
    ASSERT_EQ(expected.size(), got.size()) << k;
    for (size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(expected[i].id, got[i].id);
      EXPECT_LT((got[i].T_camera_object.inverse() * expected[i].T_camera_object).log().norm(), 1e-9);
      EXPECT_EQ(*expected[i].size_m, *got[i].size_m);
      EXPECT_EQ(expected[i].type, got[i].type);
      if (moving) {
        EXPECT_EQ(expected[i].moving, got[i].moving);
      }
      if (!boxes) continue;
      EXPECT_EQ(expected[i].box, got[i].box);
    }
  }
}

TEST_P(VkittiLayouts, SceneReadsBackAsItWasWritten) {
  const auto source = open_with("synthetic:s18@0-3");
  const std::string text = write(*source);
  EXPECT_EQ(text, GetParam() + (":" + (temp_.path() / "D").string()) +
                      (first() ? "#0018/clone" : "#Scene18/clone"));
  const auto read = open_with(text);
  const SequenceInfo& info = read->info();
  EXPECT_EQ(info.first_frame, 0);
  EXPECT_EQ(info.last_frame, 3);
  EXPECT_EQ(info.width, 1242);
  EXPECT_EQ(info.height, 375);
  EXPECT_EQ(info.camera.left.fx, source->info().camera.left.fx);
  EXPECT_NEAR(info.camera.bf, source->info().camera.bf, 1e-9);
  read->check_files();

  RoundTripErrors errors;
  for (int k = 0; k <= 3; ++k) {
    const Frame expected = source->read(k, measured_channels);
    const Frame got = read->read(k, measured_channels);
    EXPECT_EQ(expected.mask, got.mask);
    compare_depth(expected.depth_m, got.depth_m, errors);
    if (!expected.flow.empty()) compare_flow(expected.flow, got.flow, errors);
    if (first()) {
      EXPECT_EQ(source->read(k, {.rgb = true}).rgb, read->read(k, {.rgb = true}).rgb);
    }
  }
  RecordProperty("depth_max_cm", fmt::format("{:.4f}", 100 * errors.depth_m));
  RecordProperty("flow_max_steps", fmt::format("{:.4f}", errors.flow_steps));
  EXPECT_GT(errors.n_depth, 1'000'000);
  EXPECT_GT(errors.n_flow, 700'000);
  EXPECT_LE(errors.depth_m, 0.005 * (1 + 1e-3));  // float32 above 100 m
  EXPECT_LE(errors.flow_steps, 0.5 * (1 + 1e-2));
  expect_same_truth(*source, *read, true, !first());
}

TEST_P(VkittiLayouts, EveryChannelReadsBack) {
  const FormulaSequence source;
  const auto read = open_with(write(source, "0001/fog"));
  EXPECT_EQ(read->info().sequence, first() ? "0001/fog" : "Scene01/fog");
  EXPECT_EQ(read->info().first_frame, 3);
  EXPECT_TRUE(read->info().warnings.empty()) << read->info().warnings.front();
  EXPECT_EQ(read->info().channels.rgb_right, !first());
  EXPECT_EQ(read->info().channels.backward_flow, !first());
  RoundTripErrors errors, backward;
  const Channels all = Channels::all();
  for (int k = 3; k <= 6; ++k) {
    const Frame expected = source.read(k, all);
    const Frame got = read->read(k, all);
    EXPECT_EQ(expected.mask, got.mask);
    EXPECT_EQ(got.gray.empty(), false);
    compare_depth(expected.depth_m, got.depth_m, errors);
    EXPECT_EQ(got.flow.empty(), k == 6);
    if (k < 6) compare_flow(expected.flow, got.flow, errors);
    EXPECT_EQ(got.backward_flow.empty(), first() || k == 3);
    if (!got.backward_flow.empty()) compare_flow(expected.backward_flow, got.backward_flow, backward);
    if (first()) {
      EXPECT_EQ(expected.rgb, got.rgb);
      continue;
    }
    for (const auto& [a, b] : {std::pair{&expected.rgb, &got.rgb}, {&expected.rgb_right, &got.rgb_right}}) {
      double worst = 0;
      for (size_t i = 0; i < a->size(); ++i)
        worst = std::max(worst, std::abs(1.0 * a->data()[i].r - b->data()[i].r));
      EXPECT_LE(worst, 6);  // JPEG compression
    }
  }
  EXPECT_LE(errors.depth_m, 0.005 * (1 + 1e-2));
  EXPECT_LE(errors.flow_steps, 0.5 * (1 + 1e-2));
  EXPECT_LE(backward.flow_steps, 0.5 * (1 + 1e-2));
  EXPECT_EQ(backward.n_flow > 0, !first());
  expect_same_truth(source, *read, false, true);
  // The truth has no box: the box is computed from the mask.
  EXPECT_EQ(read->truth().objects.at(4)[0].box, (ImageBox{204, 100, 299, 149}));
}

TEST_P(VkittiLayouts, BytesDoNotDependOnThreads) {
  const FormulaSequence source({.last_frame = 4});
  write(source, "0001/clone", 1);
  const auto one = files_below(temp_.path() / "D");
  fs::remove_all(temp_.path() / "D");
  write(source, "0001/clone", 3);
  EXPECT_EQ(one == files_below(temp_.path() / "D"), true);
  EXPECT_GE(one.size(), 10u);
}

TEST_P(VkittiLayouts, ASecondSequenceIsAddedAndNoneIsOverwritten) {
  const FormulaSequence source({.first_frame = 3, .last_frame = 3});
  write(source, "0001/clone");
  write(source, "0001/rain");
  expect_error([&] { write(source, "0001/rain"); }, "/rain exists already: remove it");
}

TEST_P(VkittiLayouts, TheDefaultNameIsTheNumber) {
  const std::string text = write(FormulaSequence({.first_frame = 3, .last_frame = 3}));
  EXPECT_THAT(text, testing::EndsWith(first() ? "#0018/clone" : "#Scene18/clone"));
}

TEST_P(VkittiLayouts, UnrepresentableSequencesAreErrors) {
  FormulaSequence hole;
  Trajectory camera;
  for (const int k : {3, 4, 6}) camera.set(k, *hole.truth().camera.pose(k));
  hole.truth_.camera = camera;
  expect_error([&] { write(hole, "0001"); }, "formula:f18 frame 5: no true camera pose");
  hole.truth_.camera = Trajectory();
  expect_error([&] { write(hole, "0001"); },
               "formula:f18 frame 3: it has true objects, but no true camera poses");
  expect_error([&] { write(FormulaSequence({.size = false}), "0002"); },
               "formula:f18 frame 3: object 3 has no box size");
  FormulaSequence words({.last_frame = 3});
  words.truth_.objects.at(3)[0].type = "big car";
  expect_error([&] { write(words, "0003"); }, "has the type 'big car': the layout needs one word");
  expect_error([&] { write(hole, "first/clone"); }, "sequence 'first/clone': expected");
  LayoutRequest request;
  request.out = temp_.path() / "E";
  request.options["qality"] = 3;
  expect_error([&] { find_layout(GetParam()).write(hole, request); }, "unknown option key 'layout.qality'");
}

TEST_P(VkittiLayouts, WithoutTruthThereIsNoText) {
  const auto read = open_with(write(FormulaSequence({.last_frame = 4, .truth = false}), "0001"));
  EXPECT_TRUE(read->truth().camera.empty());
  EXPECT_TRUE(read->truth().objects.empty());
  EXPECT_FALSE(read->info().warnings.empty());
  EXPECT_EQ(read->read(3, {.mask = true}).mask(250, 120), 3);
}

TEST_P(VkittiLayouts, MovingComesFromThePosesWhenItIsUnknown) {
  FormulaSequence source({.first_frame = 3, .last_frame = 5});
  SequenceTruth& truth = source.truth_;
  const SE3 T_world_object = *truth.camera.pose(3) * truth.objects.at(3)[0].T_camera_object;
  for (const int k : {3, 4}) {  // at rest until frame 4, then moving
    truth.objects.at(k)[0].T_camera_object = truth.camera.pose(k)->inverse() * T_world_object;
  }
  for (auto& [frame, objects] : truth.objects) objects[0].moving.reset();
  const auto read = open_with(write(source, "0001"));
  EXPECT_EQ(read->truth().find(3, 3)->moving, false);
  EXPECT_EQ(read->truth().find(4, 3)->moving, true);
  EXPECT_EQ(read->truth().find(5, 3)->moving, true);  // the last frame: as from the previous one
}

INSTANTIATE_TEST_SUITE_P(Both, VkittiLayouts, testing::Values("vkitti1", "vkitti2"));

// The definition of the column truncr is not documented: compares the data set's rows with the share of the
// volume.
TEST(Vkitti1Layout, TruncationIsThatOfTheDataSet) {
  SEXTANT_NEEDS_DATA("vkitti_1.3.1_text");
  const fs::path folder = real_data("vkitti_1.3.1_text");
  const SequenceInfo info = FormulaSequence().info();
  for (const char* world : {"0001", "0002", "0018"}) {
    const auto source = open_with(fmt::format("vkitti1:{}#{}", folder.string(), world));
    const fs::path path = folder / fmt::format("{}_objects.txt", world);
    std::vector<double> errors;
    for (const Vkitti1Object& row : decode_vkitti1_objects(read_file(path), path.string())) {
      if (row.truncr == 0) continue;
      const ObjectTruth* object = source->truth().find(row.frame, row.tid + 1);
      ASSERT_NE(object, nullptr);
      errors.push_back(std::abs(box_truncation(info, *object) - row.truncr));
    }
    ASSERT_GT(errors.size(), 50u);
    std::ranges::sort(errors);
    EXPECT_LT(errors[errors.size() / 2], 0.05) << world;
  }
}

TEST(Vkitti1Layout, OnlyItsOwnCamera) {
  FormulaSequence source;
  source.info_.camera.left.fx = 721;
  expect_error([&] { write_vkitti1_layout(source, {}); }, "cannot store a camera other than f = 725");
}

TEST(Vkitti1Layout, FilesHaveTheirOfficialNames) {
  TempFolder temp;
  LayoutRequest request{.out = temp.path(), .sequence = "0001/clone", .quiet = true};
  write_vkitti1_layout(FormulaSequence({.first_frame = 3, .last_frame = 4, .id = 1}), request);
  const auto files = files_below(temp.path());
  std::vector<std::string> names;
  for (const auto& [name, bytes] : files) names.push_back(name);
  EXPECT_THAT(names,
              UnorderedElementsAre(
                  "vkitti_1.3.1_rgb/0001/clone/00003.png", "vkitti_1.3.1_rgb/0001/clone/00004.png",
                  "vkitti_1.3.1_depthgt/0001/clone/00003.png", "vkitti_1.3.1_depthgt/0001/clone/00004.png",
                  "vkitti_1.3.1_flowgt/0001/clone/00003.png", "vkitti_1.3.1_scenegt/0001/clone/00003.png",
                  "vkitti_1.3.1_scenegt/0001/clone/00004.png",
                  "vkitti_1.3.1_scenegt/0001_clone_scenegt_rgb_encoding.txt",
                  "vkitti_1.3.1_extrinsicsgt/0001_clone.txt", "vkitti_1.3.1_motgt/0001_clone.txt"));
  EXPECT_THAT(files.at("vkitti_1.3.1_scenegt/0001_clone_scenegt_rgb_encoding.txt"),
              StartsWith("Category(:id) r g b\nMisc 80 80 80\nVan:0 "));
  const auto objects = decode_vkitti1_objects(files.at("vkitti_1.3.1_motgt/0001_clone.txt"), "motgt");
  EXPECT_EQ(objects[0].occupr, 1);  // the mask is a full rectangle
  EXPECT_EQ(objects[0].occluded, 0);
  EXPECT_EQ(objects[0].tid, 0);
}

TEST(Vkitti2Layout, FilesHaveTheirOfficialNames) {
  TempFolder temp;
  LayoutRequest request{.out = temp.path(), .sequence = "Scene01/clone", .quiet = true};
  write_vkitti2_layout(FormulaSequence({.first_frame = 3, .last_frame = 4, .id = 300}), request);
  std::vector<std::string> names;
  for (const auto& [name, bytes] : files_below(temp.path() / "Scene01/clone")) names.push_back(name);
  EXPECT_THAT(names, UnorderedElementsAre(
                         "extrinsic.txt", "intrinsic.txt", "pose.txt", "bbox.txt", "info.txt", "colors.txt",
                         "frames/rgb/Camera_0/rgb_00003.jpg", "frames/rgb/Camera_0/rgb_00004.jpg",
                         "frames/rgb/Camera_1/rgb_00003.jpg", "frames/rgb/Camera_1/rgb_00004.jpg",
                         "frames/depth/Camera_0/depth_00003.png", "frames/depth/Camera_0/depth_00004.png",
                         "frames/forwardFlow/Camera_0/flow_00003.png",
                         "frames/backwardFlow/Camera_0/backwardFlow_00004.png",
                         "frames/instanceSegmentation/Camera_0/instancegt_00003.png",
                         "frames/instanceSegmentation/Camera_0/instancegt_00004.png"));
  const auto mask = open_with("vkitti2:" + temp.path().string() + "#Scene01")->read(3, {.mask = true}).mask;
  EXPECT_EQ(mask(250, 120), 300);  // more than 8 bits
  const auto poses = decode_vkitti2_poses(read_file(temp.path() / "Scene01/clone/pose.txt"), "pose.txt");
  const FormulaSequence source;
  const Eigen::Vector3d world =
      (*source.truth().camera.pose(3) * source.truth().objects.at(3)[0].T_camera_object).translation();
  EXPECT_LT((poses[0].world_m - world).norm(), 1e-9);
}

}  // namespace
}  // namespace sextant
