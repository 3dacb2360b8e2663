#include "sextant/datasets/vkitti1.h"

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/vkitti_testing.h"

namespace sextant {
namespace {

constexpr Channels all_channels{.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
const std::string extrinsics = "vkitti_1.3.1_extrinsicsgt/0001_clone.txt";
const std::string objects_file = "vkitti_1.3.1_motgt/0001_clone.txt";
const std::string colors = "vkitti_1.3.1_scenegt/0001_clone_scenegt_rgb_encoding.txt";

std::string png(const char* kind, int frame) {
  return fmt::format("vkitti_1.3.1_{}/0001/clone/{:05}.png", kind, frame);
}

class Vkitti1Files : public VkittiFiles {
 protected:
  Vkitti1Files() : VkittiFiles("vkitti1", "0001/clone") {}
};

TEST_F(Vkitti1Files, InfoSaysWhatIsThere) {
  const auto sequence = open_with(source_);
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(text_of(info), "vkitti1 0001/clone@3-6, 1242x375 px, 10 Hz");
  EXPECT_EQ(info.camera.left.fx, 725);
  EXPECT_EQ(info.camera.left.cx, 620.5);
  EXPECT_EQ(info.camera.left.cy, 187);
  EXPECT_DOUBLE_EQ(info.camera.bf, 386.225625);
  EXPECT_THAT(info.provenance, ElementsAre(StartsWith("depth: cm:"), StartsWith("flow: vkitti_png:"),
                                           StartsWith("masks: scene colours:")));
  sequence->check_files();
  EXPECT_EQ(open_with(source_ + "@4-5")->info().last_frame, 5);
  EXPECT_EQ(open_with("vkitti1:" + root_.string() + "#0001")->info().sequence, "0001/clone");
  EXPECT_EQ(open_with(source_, {{"bf", 100.0}, {"rate_hz", 5.0}})->info().camera.bf, 100);
}

TEST_F(Vkitti1Files, AnySubsetOpens) {
  remove("vkitti_1.3.1_flowgt");
  EXPECT_EQ(open_with(source_)->info().provenance[1], "flow: dis");
  EXPECT_FALSE(open_with(source_)->true_flow(4).has_value());
  remove("vkitti_1.3.1_rgb");
  const auto depth = open_with(source_);
  EXPECT_TRUE(depth->info().channels.depth);
  EXPECT_FALSE(depth->info().channels.flow || depth->info().channels.rgb || depth->info().channels.gray);
  remove("vkitti_1.3.1_depthgt");
  EXPECT_TRUE(open_with(source_)->info().channels.mask);
  remove("vkitti_1.3.1_scenegt");
  const auto text_only = open_with(source_);
  const Channels& channels = text_only->info().channels;
  EXPECT_FALSE(channels.gray || channels.rgb || channels.depth || channels.flow || channels.mask);
  EXPECT_EQ(text_only->info().width, 1242);
  EXPECT_EQ(text_only->info().height, 375);
  EXPECT_EQ(text_only->info().first_frame, 3);
  EXPECT_EQ(text_only->truth().objects.size(), 4u);
  EXPECT_TRUE(text_only->read(4, all_channels).depth_m.empty());
  text_only->check_files();
  remove(extrinsics);
  EXPECT_THAT(open_with(source_)->info().warnings,
              ElementsAre("no extrinsicsgt of world 0001: no true camera motion"));
}

TEST_F(Vkitti1Files, OtherChannelsLeaveTheTruthTrue) {
  const auto own = open_with(source_);
  fs::create_directories(root_ / "half");
  for (int k = 3; k <= 6; ++k) {
    put(fmt::format("half/{:05}.png", k), encode_png(Image<uint16_t>(1242, 375, 800)));
  }
  const auto other =
      open_with(source_, {{"flow", "dis"}, {"depth", "cm:" + file("half")}, {"masks", "boxes"}});
  EXPECT_EQ(other->read(4, {.depth = true}).depth_m(600, 200), 8.0f);
  EXPECT_EQ(other->true_depth(4)->operator()(600, 200), own->read(4, {.depth = true}).depth_m(600, 200));
  const Flow f = other->true_flow(4)->operator()(700, 200);
  EXPECT_EQ(f.u, own->read(4, {.flow = true}).flow(700, 200).u);
  EXPECT_FALSE(other->true_flow(6).has_value());
  EXPECT_EQ(other->read(4, {.mask = true}).mask(250, 120), 3);
  EXPECT_EQ(other->info().provenance[1], "flow: dis");
  expect_error([&] { open_with(source_, {{"flow", "diss"}}); }, "unknown choice 'diss'");
  expect_error([&] { open_with(source_, {{"depth", "sgbm"}}); }, "sgbm");  // no right image
  expect_error([&] { open_with(source_, {{"rate_hz", 0.0}}); }, "option rate_hz = 0: must be > 0");
}

TEST_F(Vkitti1Files, EachArchiveInAFolderOfItsOwnName) {
  for (const char* kind : {"rgb", "depthgt", "flowgt", "scenegt", "extrinsicsgt", "motgt"}) {
    const fs::path folder = root_ / fmt::format("vkitti_1.3.1_{}", kind);
    fs::rename(folder, root_ / "moved");
    fs::create_directory(folder);
    fs::rename(root_ / "moved", folder / folder.filename());
  }
  const auto sequence = open_with(source_);
  sequence->check_files();
  EXPECT_EQ(sequence->read(4, all_channels).mask(250, 120), 3);
  EXPECT_EQ(sequence->truth().objects.size(), 4u);
}

TEST_F(Vkitti1Files, NamesThatAreNotThere) {
  const std::string root = "vkitti1:" + root_.string();
  expect_error([&] { open_with(root + "_no#0001"); }, "_no: no such folder");
  expect_error([&] { open_with(root + "#0002"); }, "no world '0002' in it; there: 0001");
  expect_error([&] { open_with(root + "#0001/fogg"); },
               "world 0001 has no variation 'fogg' in it; there: clone");
  expect_error([&] { open_with(root); },
               "say which world: vkitti1:" + root_.string() + "#<world>/<variation>; there: 0001");
  expect_error([&] { open_with("vkitti1:" + temp_.path().string() + "#0001"); },
               "no Virtual KITTI 1.3.1 in it");
  expect_error([&] { open_with(source_ + "@0-3"); }, "frames 0-3 asked for, it has frames 3-6");
}

TEST_F(Vkitti1Files, MissingFiles) {
  remove(png("rgb", 4));
  expect_error([&] { open_with(source_); },
               "vkitti_1.3.1_rgb/0001/clone: frame 4 is missing between 3 and 6");
  remove(colors);
  expect_error([&] { open_with(source_ + "@5-6"); }, file(colors));
}

TEST_F(Vkitti1Files, FilesOfAnotherKind) {
  const auto sequence = open_with(source_);
  const auto error = [&](const char* kind, const std::string& bytes, const std::string& message) {
    const std::string good = text(png(kind, 4));
    put(png(kind, 4), bytes);
    expect_error([&] { sequence->read(4, all_channels); }, file(png(kind, 4)) + message);
    put(png(kind, 4), good);
  };
  error("depthgt", encode_png(Image<uint8_t>(1242, 375)), ": ");  // 8 bit
  error("flowgt", encode_png(Image<Rgb>(1242, 375)), ": ");
  for (int k = 3; k <= 6; ++k) put(png("rgb", k), encode_png(Image<Rgb>(621, 187)));
  expect_error([&] { open_with(source_); }, "images of 621x187 pixels: the data set's camera");
}

TEST_F(Vkitti1Files, ColoursThatTheTableLacks) {
  change(colors, "Van:2 ", "Van:2 1 ");
  expect_error([&] { open_with(source_); }, file(colors) + ":3: expected 4 values");
  put_lines(colors, {"Category(:id) r g b", "Misc 80 80 80"});
  const auto sequence = open_with(source_);
  expect_error([&] { sequence->read(4, all_channels); },
               file(png("scenegt", 4)) + ": pixel (204, 100) has the colour ");
  put_lines(colors, {"Category(:id) r g b", "Van:65535 80 80 80"});
  expect_error([&] { open_with(source_); }, "track id 65535 is too large");
}

TEST_F(Vkitti1Files, BadText) {
  std::vector<std::string> rows = lines(extrinsics);
  const std::vector<std::string> good = rows;
  rows[2].replace(rows[2].find(' ') + 1, 3, "nan");
  rows[2] = "4 nan" + rows[2].substr(rows[2].find(' ', 3));
  put_lines(extrinsics, rows);
  expect_error([&] { open_with(source_); }, file(extrinsics) + ":3: expected a finite number");
  put_lines(extrinsics, {good[0], good[1], good[2], good[3]});
  expect_error([&] { open_with(source_); }, file(objects_file) + ": it has objects in frame 6, of which " +
                                                file(extrinsics) + " has no pose");
  remove(objects_file);
  expect_error([&] { open_with(source_); },
               "the extrinsics have no row of frame 6, of which there are files: take both");
  EXPECT_EQ(open_with(source_ + "@3-5")->info().last_frame, 5);
}

TEST_F(Vkitti1Files, BadObjects) {
  const std::vector<std::string> rows = lines(objects_file);
  put_lines(objects_file, {rows[0], rows[1], rows[1]});
  expect_error([&] { open_with(source_); }, file(objects_file) + ":3: track 2 appears twice in frame 3");
  std::string header = rows[0];
  header.replace(header.find("moving"), 6, "moves");
  put_lines(objects_file, {header, rows[1]});
  expect_error([&] { open_with(source_); }, file(objects_file) + ":1: the first row names no column moving");
}

}  // namespace
}  // namespace sextant
