#include "sextant/datasets/vkitti2.h"

#include "sextant/base/testing.h"
#include "sextant/datasets/vkitti_testing.h"

namespace sextant {
namespace {

constexpr Channels vkitti2_channels = Channels::all();
const std::string scene = "Scene01/clone/";

class Vkitti2Files : public VkittiFiles {
 protected:
  Vkitti2Files() : VkittiFiles("vkitti2", "Scene01/clone") {}
};

TEST_F(Vkitti2Files, InfoSaysWhatIsThere) {
  const auto sequence = open_with(source_);
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(text_of(info), "vkitti2 Scene01/clone@3-6, 1242x375 px, 10 Hz");
  EXPECT_EQ(info.camera.left.fx, 725);
  EXPECT_NEAR(info.camera.bf, 725 * 0.532725, 1e-9);
  EXPECT_TRUE(info.warnings.empty());
  EXPECT_THAT(info.provenance,
              ElementsAre(StartsWith("depth: cm:"), StartsWith("flow: vkitti_png:"),
                          StartsWith("masks: instance_png:"), StartsWith("backward flow: vkitti_png:")));
  sequence->check_files();
  const std::string root = "vkitti2:" + root_.string();
  for (const char* name : {"#0001/clone", "#Scene01", "#0001", "#1"}) {
    EXPECT_EQ(open_with(root + name)->info().sequence, "Scene01/clone") << name;
  }
}

TEST_F(Vkitti2Files, TheRightCameraHasNoPartner) {
  const auto left = open_with(source_);
  const auto right = open_with(source_, {{"camera", 1}});
  EXPECT_FALSE(right->info().channels.rgb_right || right->info().channels.depth);
  EXPECT_EQ(right->read(4, vkitti2_channels).rgb, left->read(4, vkitti2_channels).rgb_right);
  const SE3 T_left_right = left->truth().camera.pose(4)->inverse() * *right->truth().camera.pose(4);
  EXPECT_LT((T_left_right.log() - (Vector6d() << 0.532725, 0, 0, 0, 0, 0).finished()).norm(), 1e-9);
  // The text files list only the objects of the left camera.
  EXPECT_TRUE(right->truth().objects.empty());
  EXPECT_THAT(right->info().warnings,
              ElementsAre(file(scene + "pose.txt") +
                              ": no rows of camera 1, only of camera 0: there is no true object motion",
                          file(scene + "bbox.txt") +
                              ": no rows of camera 1, only of camera 0: objects have no boxes"));
  expect_error(
      [&] {
        open_with(source_, {{"camera", 2}});
      },
      "option source.vkitti2.camera = 2: must be 0 or 1");
}

TEST_F(Vkitti2Files, AnySubsetOpens) {
  remove(scene + "frames/forwardFlow");
  remove(scene + "frames/depth");
  const auto images = open_with(source_);
  EXPECT_THAT(images->info().provenance, Contains("flow: dis"));
  EXPECT_THAT(images->info().provenance, Contains(HasSubstr("depth: sgbm")));
  remove(scene + "frames");
  const auto text_only = open_with(source_);
  const Channels& channels = text_only->info().channels;
  EXPECT_FALSE(channels.gray || channels.rgb || channels.rgb_right || channels.depth || channels.flow ||
               channels.backward_flow || channels.mask);
  EXPECT_EQ(text_only->info().width, 1242);
  EXPECT_EQ(text_only->truth().objects.size(), 4u);
  remove(scene + "bbox.txt");
  remove(scene + "info.txt");
  remove(scene + "intrinsic.txt");
  const auto bare = open_with(source_);
  EXPECT_EQ(bare->info().warnings.size(), 3u);
  EXPECT_EQ(bare->info().camera.left.fx, 725.0087);
  EXPECT_FALSE(bare->truth().find(4, 3)->box.has_value());
  EXPECT_FALSE(bare->truth().find(4, 3)->moving.has_value());
}

TEST_F(Vkitti2Files, EachArchiveInAFolderOfItsOwnName) {
  const auto move = [&](const std::string& from, const std::string& archive) {
    const fs::path to = root_ / ("vkitti_2.0.3_" + archive) / from;
    fs::create_directories(to.parent_path());
    fs::rename(root_ / from, to);
  };
  for (const char* kind : {"rgb", "depth", "forwardFlow", "backwardFlow", "instanceSegmentation"}) {
    move(scene + "frames/" + kind, kind);
  }
  for (const char* name : {"extrinsic", "intrinsic", "pose", "bbox", "info", "colors"}) {
    move(scene + name + ".txt", "textgt");
  }
  remove("Scene01");
  const auto sequence = open_with(source_);
  sequence->check_files();
  EXPECT_TRUE(sequence->info().warnings.empty());
  EXPECT_EQ(sequence->info().provenance.size(), 4u);
  EXPECT_EQ(sequence->read(4, vkitti2_channels).mask(250, 120), 3);
}

TEST_F(Vkitti2Files, UnknownNamesAreErrors) {
  const std::string root = "vkitti2:" + root_.string();
  expect_error([&] { open_with(root + "_no#0001"); }, "_no: no such folder");
  expect_error([&] { open_with(root + "#Scene02"); }, "no scene 'Scene02' in it; available: Scene01");
  expect_error([&] { open_with(root + "#Scene01/fogg"); },
               "Scene01 has no variation 'fogg' in it; available: clone");
  expect_error([&] { open_with(root); },
               "choose a scene: vkitti2:" + root_.string() + "#<scene>/<variation>; available: Scene01");
  expect_error([&] { open_with("vkitti2:" + temp_.path().string() + "#0001"); }, "no Virtual KITTI 2 in it");
}

TEST_F(Vkitti2Files, CamerasThatChange) {
  const std::vector<std::string> rows = lines(scene + "intrinsic.txt");
  std::vector<std::string> changed = rows;
  changed[3] = "4 0 726 725 620.5 187";
  put_lines(scene + "intrinsic.txt", changed);
  expect_error([&] { open_with(source_); },
               "intrinsic.txt: the camera of frame 4 (726 725 620.5 187) differs from that of frame 3");
  put_lines(scene + "intrinsic.txt", {rows[0], rows[2]});
  expect_error([&] { open_with(source_); }, "intrinsic.txt: no rows of camera 0");
  put_lines(scene + "intrinsic.txt", rows);

  const std::vector<std::string> poses = lines(scene + "extrinsic.txt");
  put_lines(scene + "extrinsic.txt", {poses[0], poses[2], poses[4], poses[6], poses[8]});
  expect_error([&] { open_with(source_); }, "extrinsic.txt: no rows of camera 0; available: 1");
  changed = poses;
  changed[4] = "4 1" + poses[6].substr(3);  // the right camera of the next frame
  put_lines(scene + "extrinsic.txt", changed);
  expect_error([&] { open_with(source_); }, "extrinsic.txt: frame 4: the cameras are not a rectified pair");
}

TEST_F(Vkitti2Files, AnotherBaselineIsThatOfTheFile) {
  FormulaSequence source({.first_frame = 3, .last_frame = 4});
  source.info_.camera = {{500, 510, 600, 180}, 500 * 0.25};
  LayoutRequest request{.out = temp_.path() / "E", .quiet = true};
  const auto sequence = open_with(find_layout("vkitti2").write(source, request));
  EXPECT_EQ(sequence->info().camera.left.fy, 510);
  EXPECT_NEAR(sequence->info().camera.bf, 125, 1e-9);
  EXPECT_THAT(sequence->info().warnings, ElementsAre(StartsWith("baseline of 0.250000 m")));
}

TEST_F(Vkitti2Files, BadText) {
  const auto error = [&](const std::string& name, const std::vector<std::string>& rows,
                         const std::string& message) {
    const std::string good = text(scene + name);
    put_lines(scene + name, rows);
    expect_error([&] { open_with(source_); }, file(scene + name) + message);
    put(scene + name, good);
  };
  const std::vector<std::string> extrinsic = lines(scene + "extrinsic.txt");
  error("extrinsic.txt", {extrinsic[0], "3 0 nan" + extrinsic[1].substr(extrinsic[1].find(' ', 4))},
        ":2: expected a finite number");
  const std::vector<std::string> pose = lines(scene + "pose.txt");
  error("pose.txt", {pose[0], pose[1], pose[1]}, ":3: track 2 appears twice in frame 3 of camera 0");
  error("pose.txt", {pose[0], "9" + pose[1].substr(1)}, ": it has objects in frame 9");
  const std::vector<std::string> bbox = lines(scene + "bbox.txt");
  error("bbox.txt", {bbox[0], bbox[1], bbox[2]}, ": no row of track 2 in frame 5 of camera 0");
  error("info.txt", {"trackID label model color", "7 Car a b"}, ": no row of track 2, which");
  error("bbox.txt", {"frame cameraID trackID left right top bottom"},
        ":1: the first row names no column number_pixels, truncation_ratio, occupancy_ratio, isMoving");
  put_lines(scene + "extrinsic.txt", {extrinsic[0], extrinsic[1], extrinsic[2]});
  remove(scene + "pose.txt");
  expect_error([&] { open_with(source_); }, "the extrinsics have no row of frame 4");
}

}  // namespace
}  // namespace sextant
