#include "sextant/datasets/kitti_tracking.h"

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/kitti_testing.h"
#include "sextant/datasets/testing.h"

namespace sextant {
namespace {

constexpr Channels kitti_channels{
    .gray = true, .rgb = true, .rgb_right = true, .depth = true, .flow = true, .mask = true};

class KittiTracking : public FolderTest {
 protected:
  KittiTracking() : FolderTest("training") {
    write_kitti_layout(PatternSequence(5),
                       {.out = temp_.path(), .sequence = "0007", .jobs = 1, .quiet = true});
  }
  std::unique_ptr<Sequence> open(const std::string& rest = "#0007",
                                 const Json& options = Json::object()) const {
    return open_with("kitti:" + temp_.path().string() + rest, options);
  }
};

TEST_F(KittiTracking, InfoSaysWhatIsThere) {
  const auto sequence = open("#0007@1-3");
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(text_of(info), "kitti 0007@1-3, 160x48 px, 10 Hz");
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_THAT(info.provenance, Contains("depth: depth256:" + file("depth_02/0007")));
  EXPECT_THAT(info.provenance, Contains("flow: kitti_png:" + file("flow_02/0007")));
  EXPECT_THAT(info.provenance, Contains("masks: mots_png:" + file("instances/0007")));
  EXPECT_THAT(info.provenance, Contains(HasSubstr("camera truth: oxts, rectified, raw")));
  EXPECT_THAT(info.provenance, Contains(HasSubstr("camera truth floor: raw steps scatter by")));
  EXPECT_TRUE(sequence->truth().camera_step_floor_m.has_value());
  EXPECT_EQ(open("#0007", {{"rate_hz", 9.66}})->info().rate_hz, 9.66);
}

TEST_F(KittiTracking, ComputesChannelsWithoutFiles) {
  remove("depth_02");
  remove("flow_02");
  const auto sequence = open();
  EXPECT_THAT(sequence->info().provenance, Contains("flow: dis"));
  EXPECT_THAT(sequence->info().provenance, Contains(HasSubstr("depth: sgbm")));
  EXPECT_TRUE(sequence->info().warnings.empty());
  sequence->check_files();
  const Frame frame = sequence->read(1, kitti_channels);
  // The texture moves by one pixel per frame, and lies 5 px further left in the right image: z = bf / 5.
  EXPECT_NEAR(frame.flow(80, 24).u, -1, 0.2);
  EXPECT_NEAR(frame.depth_m(80, 24), 60.0 / 5, 0.5);
  EXPECT_TRUE(sequence->read(4, kitti_channels).flow.empty());
}

TEST_F(KittiTracking, WithoutRightImagesThereIsNoDepth) {
  remove("depth_02");
  remove("image_03");
  const auto sequence = open();
  EXPECT_FALSE(sequence->info().channels.depth);
  EXPECT_TRUE(sequence->read(0, kitti_channels).depth_m.empty());
  EXPECT_THAT(sequence->info().missing, ElementsAre(HasSubstr(file("depth_02/0007") + " and " +
                                                              file("image_03/0007") + " do not exist")));
  expect_error(
      [&] {
        open("#0007", {{"depth", "sgbm"}});
      },
      file("image_03/0007") + ": no such folder, and depth = sgbm needs its right images: add it, or");
}

TEST_F(KittiTracking, MasksUseTheBestAvailableFiles) {
  const Image<uint16_t> mask = PatternSequence(5).read(3, {.mask = true}).mask;
  EXPECT_EQ(open()->read(3, {.mask = true}).mask, mask);
  remove("instances");
  EXPECT_THAT(open()->info().provenance, Contains("masks: mots_txt:" + file("instances_txt/0007.txt")));
  EXPECT_EQ(open()->read(3, {.mask = true}).mask, mask);
  const auto boxes = open("#0007", {{"masks", "boxes"}});
  EXPECT_THAT(boxes->info().provenance, Contains("masks: boxes"));
  EXPECT_EQ(boxes->read(3, {.mask = true}).mask(30, 20), 1);
  remove("instances_txt");
  const auto without = open();
  EXPECT_FALSE(without->info().channels.mask);
  EXPECT_THAT(without->info().missing, ElementsAre(HasSubstr("no masks (option masks = boxes")));
  EXPECT_FALSE(open("#0007", {{"flow", "none"}})->info().channels.flow);
}

TEST_F(KittiTracking, OpensWithTruthOnly) {
  for (const char* folder : {"image_02", "image_03", "depth_02", "flow_02", "instances"}) remove(folder);
  const auto with_size = open();
  EXPECT_EQ(with_size->info().width, 160);
  EXPECT_FALSE(with_size->info().channels.gray || with_size->info().channels.depth);
  EXPECT_TRUE(with_size->info().channels.mask);
  EXPECT_EQ(with_size->read(1, kitti_channels).mask, PatternSequence(5).read(1, kitti_channels).mask);
  EXPECT_TRUE(with_size->read(1, kitti_channels).gray.empty());
  remove("instances_txt");
  const auto sequence = open();
  EXPECT_EQ(sequence->info().width, 1242);
  EXPECT_EQ(sequence->info().height, 375);
  EXPECT_EQ(sequence->info().last_frame, 4);
  EXPECT_EQ(sequence->truth().camera.poses().size(), 5u);
  EXPECT_THAT(sequence->info().missing, Contains(HasSubstr("the size of the images is unknown")));
  sequence->check_files();
  remove("oxts");
  EXPECT_EQ(open()->info().last_frame, 4);  // from the labels
  remove("label_02");
  expect_error([&] { open(); }, "sequence 0007: there are no frames");
}

TEST_F(KittiTracking, MissingTruthIsAWarning) {
  remove("oxts");
  remove("label_02");
  const auto sequence = open();
  EXPECT_THAT(sequence->info().warnings,
              ElementsAre(file("oxts/0007.txt") + " does not exist, so there is no true camera motion",
                          file("label_02/0007.txt") + " does not exist, so there is no true object motion"));
  EXPECT_TRUE(sequence->truth().camera.empty());
  EXPECT_FALSE(sequence->truth().camera_step_floor_m.has_value());
}

TEST_F(KittiTracking, DontCareIsNoObject) {
  const std::string labels = text("label_02/0007.txt");
  const std::string row = "-1 DontCare -1 -1 -10 1 2 3 4 -1000 -1000 -1000 -10 -1 -1 -1\n";
  put("label_02/0007.txt", "0 " + row + "0 " + row + labels);
  EXPECT_EQ(open()->truth().objects.at(0).size(), 2u);
}

TEST_F(KittiTracking, OxtsShorterThanTheImages) {
  const std::string oxts = text("oxts/0007.txt");
  size_t end = 0;
  for (int line = 0; line < 3; ++line) end = oxts.find('\n', end) + 1;
  put("oxts/0007.txt", oxts.substr(0, end));
  expect_error([&] { open(); },
               file("oxts/0007.txt") +
                   ": it has frames 0-2, but frames 0-4 are requested: complete it, or choose @0-2");
  expect_error([&] { open("#0007@3-4"); }, "complete it, or remove it");
  EXPECT_EQ(open("#0007@0-2")->info().last_frame, 2);
  put("oxts/0007.txt", "");
  expect_error([&] { open(); }, file("oxts/0007.txt") + ": no oxts samples in it");
}

TEST_F(KittiTracking, MissingFoldersAndSequences) {
  expect_error([&] { open("_not_here#0007"); }, "_not_here: no such folder");
  expect_error([&] { open(""); }, "no sequence is asked for: give the sequence after '#'");
  expect_error([&] { open("#0009"); }, file("calib") +
                                           ": no 0009.txt: give the sequence after "
                                           "'#' (such as #0005); there are: 0007");
  expect_error([&] { open("/training#0007"); }, "training: no folder training/calib in it");
}

TEST_F(KittiTracking, AGapInTheImages) {
  remove("image_02/0007/000002.png");
  expect_error([&] { open(); }, file("image_02/0007") + ": frame 2 is missing between 0 and 4");
  EXPECT_EQ(open("#0007@3-4")->info().first_frame, 3);
  expect_error([&] { open("#0007@0-9"); }, "frames 0-9 are requested, but it has frames 0-4");
}

TEST_F(KittiTracking, BadTextNamesFileAndLine) {
  const auto error = [&](const std::string& name, const std::string& from, const std::string& to,
                         const std::string& message) {
    const std::string good = text(name);
    change(name, from, to);
    expect_error([&] { open()->read(0, kitti_channels); }, file(name) + message);
    put(name, good);
  };
  remove("instances");
  error("calib/0007.txt", "Tr_velo_cam", "Tr_velo_to_cam",
        ":6: Tr_velo_to_cam and, in line 5, R_rect are keys");
  error("calib/0007.txt", "P3:", "P4:", ":4: unknown key 'P4'");
  error("calib/0007.txt", "P3: 120 0 80 -60", "P3: 120 0 80 60",
        ": focal length times baseline is -60 by P2");
  error("oxts/0007.txt", "49.0", "nan 49.0", ":1: expected 30 values");
  error("label_02/0007.txt", " Car", " Car 0", ":1: expected 17 columns");
  error("label_02/0007.txt", "0 3 Pedestrian", "0 0 Pedestrian", ":2: track 0 is in frame 0 twice");
  error("instances_txt/0007.txt", "48 160", "48 161", ":1");
}

TEST_F(KittiTracking, RunLengthsThatDoNotFillTheImage) {
  remove("instances");
  const std::string mots = text("instances_txt/0007.txt");
  const size_t end = mots.find('\n');
  put("instances_txt/0007.txt", mots.substr(0, end - 4) + mots.substr(end));
  expect_error([&] { open()->read(0, kitti_channels); }, file("instances_txt/0007.txt") + ":1: ");
}

TEST_F(KittiTracking, BadOptions) {
  const auto error = [&](const Json& options, const char* message) {
    expect_error([&] { open("#0007", options); }, message);
  };
  error({{"ground_truth", "author"}}, "option source.kitti.ground_truth = author: did you mean 'authors'?");
  error({{"velocity", "corrected"}},
        "option source.kitti.velocity = corrected: known: raw, velocity_corrected, velocity_vector");
  error({{"bf_preset", "gray"}}, "option source.kitti.bf_preset = gray: did you mean 'grey'?");
  error({{"bf", -1.0}}, "option source.kitti.bf = -1");
  error({{"rate_hz", 0.0}}, "option source.kitti.rate_hz = 0: must be finite and > 0");
  error({{"depht", "sgbm"}}, "unknown option key 'source.kitti.depht': did you mean 'depth'");
  error({{"flow", "diss"}}, "diss");
  error({{"masks", "mots_png:/no/such"}}, "/no/such");
}

// The masks of the real sequence 03 lie inside the label boxes with the same id.
TEST(KittiTrackingReal, MasksHaveTheIdsOfTheTracks) {
  SEXTANT_NEEDS_DATA("kitti_tracking");
  const auto sequence = open_with("kitti:" + real_data("kitti_tracking").string() + "#0003");
  EXPECT_EQ(sequence->info().width, 1242);
  EXPECT_EQ(sequence->info().last_frame, 143);
  int n = 0, n_inside = 0;
  for (int k = 0; k <= 143; k += 9) {
    const Image<uint16_t> mask = sequence->read(k, {.mask = true}).mask;
    std::map<int, std::pair<int, int>> counts;  // number of pixels, and of those inside the box
    for (const auto [x, y] : pixels(mask)) {
      const ObjectTruth* object = sequence->truth().find(k, mask(x, y));
      if (object == nullptr) continue;
      auto& [pixels, inside] = counts[object->id];
      ++pixels;
      const ImageBox& box = *object->box;
      inside += x > box.left - 5 && x < box.right + 5 && y > box.top - 5 && y < box.bottom + 5;
    }
    for (const auto& [id, count] : counts) {
      ++n;
      n_inside += count.second > 0.9 * count.first;
    }
  }
  EXPECT_GT(n, 20);
  EXPECT_GE(n_inside, 0.95 * n) << n_inside << " of " << n;
}

}  // namespace
}  // namespace sextant
