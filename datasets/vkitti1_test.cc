#include <algorithm>
#include <numbers>

#include "sextant/base/quantile.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/testing.h"
#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti_testing.h"
#include "sextant/geometry/camera.h"

namespace sextant {
namespace {

const char* const extrinsics =
    "frame r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1\n"
    "0 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"
    "1 1 0 0 0 0 1 0 0 0 0 1 -1.5 0 0 0 1\n";
const char* const objects_file =
    "frame tid label truncated occluded alpha l t r b w3d h3d l3d x3d y3d z3d ry rx rz truncr occupr "
    "orig_label "
    "moving model color\n"
    "0 4 Car 0 0 -1.5 722 186 866 281 1.6 1.4 3.7 3.0 1.4 13.1 0 0 0 0 0.9 Car 0 M C\n"
    "0 2 DontCare 0 0 -1.5 1 2 3 4 1.6 1.4 3.7 3.0 1.4 13.1 0 0 0 0 0.9 Van 1 M C\n";

class Vkitti1Truths : public FolderTest {
 protected:
  Vkitti1Truth read(const std::string& world, const std::string& variation = "clone") {
    InputLog inputs;
    return read_vkitti1_truth(root_, world, variation, inputs);
  }
};

TEST_F(Vkitti1Truths, AllThreePlaces) {
  put("a/vkitti_1.3.1_extrinsicsgt/0001_fog.txt", extrinsics);
  put("a/vkitti_1.3.1_motgt/0001_fog.txt", objects_file);
  put("b/vkitti_1.3.1_extrinsicsgt/vkitti_1.3.1_extrinsicsgt/0001_clone.txt", extrinsics);
  put("b/vkitti_1.3.1_motgt/vkitti_1.3.1_motgt/0001_clone.txt", objects_file);
  put("c/vkitti_1.3.1_text/0001_camera.txt", extrinsics);
  put("c/vkitti_1.3.1_text/0001_objects.txt", objects_file);
  InputLog inputs;
  for (const auto& [root, variation] :
       {std::pair{"a", "fog"}, {"b", "clone"}, {"c", "clone"}, {"c/vkitti_1.3.1_text", "clone"}}) {
    const Vkitti1Truth out = read_vkitti1_truth(root_ / root, "0001", variation, inputs);
    EXPECT_EQ(out.truth.camera.poses().size(), 2u) << root;
    EXPECT_TRUE(out.warnings.empty());
  }
  EXPECT_EQ(inputs.entries().size(), 6u);
}

TEST_F(Vkitti1Truths, RowsAreConverted) {
  put("vkitti_1.3.1_text/0001_camera.txt", extrinsics);
  put("vkitti_1.3.1_text/0001_objects.txt", objects_file);
  const SequenceTruth truth = read("0001").truth;
  EXPECT_NEAR(truth.camera.pose(1)->translation().z(), 1.5, 1e-12);  // camera -> world: it moved ahead
  ASSERT_EQ(truth.objects.at(0).size(), 2u);
  EXPECT_EQ(truth.objects.at(0)[0].id, 3);
  const ObjectTruth* car = truth.find(0, 5);
  ASSERT_NE(car, nullptr);
  EXPECT_EQ(*car->size_m, Eigen::Vector3d(1.6, 1.4, 3.7));
  EXPECT_EQ(car->T_camera_object.translation(), Eigen::Vector3d(3.0, 1.4, 13.1));
  EXPECT_EQ(car->box, (ImageBox{722, 186, 866, 281}));
  EXPECT_EQ(*car->moving, false);
  EXPECT_EQ(*truth.find(0, 3)->moving, true);
  EXPECT_EQ(truth.find(0, 3)->type, "Van");
}

TEST_F(Vkitti1Truths, ThePosesDecideWhereParkedIsWrong) {
  put("0018_camera.txt", extrinsics);
  put("0018_objects.txt", objects_file);
  const Vkitti1Truth out = read("0018");
  EXPECT_EQ(out.truth.find(0, 3)->moving, true);
  EXPECT_FALSE(out.truth.find(0, 5)->moving.has_value());  // appears in one frame only
  EXPECT_THAT(out.warnings, IsEmpty());
}

TEST_F(Vkitti1Truths, MissingTruthIsAWarningOrAnError) {
  fs::create_directory(root_);
  expect_error([&] { read("0001"); }, root_.string() + ": no Virtual KITTI 1.3.1 in it");
  put("vkitti_1.3.1_extrinsicsgt/0002_fog.txt", extrinsics);
  put("vkitti_1.3.1_motgt/0002_rain.txt", objects_file);
  put("0018_camera.txt", extrinsics);
  expect_error([&] { read("0001"); }, ": no world '0001' in it; available: 0002, 0018");
  expect_error([&] { read("0002"); }, ": world 0002 has no variation 'clone' in it; available: fog, rain");
  expect_error([&] { read("0002", "fog"); }, "lacks its file vkitti_1.3.1_motgt/0002_fog.txt");
  expect_error([&] { read("0018"); }, "lacks its file vkitti_1.3.1_motgt/0018_clone.txt");
  const Vkitti1TextFiles files = find_vkitti1_text(root_, "0018", "clone");
  InputLog inputs;
  EXPECT_THAT(read_vkitti1_truth(files, "0018", inputs).warnings,
              ElementsAre("world 0018 has no motgt file, so there is no true object motion"));
}

TEST_F(Vkitti1Truths, FilesOfDifferentSequences) {
  put("0001_camera.txt", extrinsics);
  std::string objects = objects_file;
  objects[objects.rfind("0 2 DontCare")] = '2';
  put("0001_objects.txt", objects);
  expect_error([&] { read("0001"); }, "0001_objects.txt: it has objects in frame 2, of which");
}

// The real text files: conventions can only be verified with numbers written by others.
class Vkitti1Real : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    SEXTANT_NEEDS_DATA("vkitti_1.3.1_text");
    InputLog inputs;
    truth_ = read_vkitti1_truth(real_data("vkitti_1.3.1_text"), GetParam(), "clone", inputs).truth;
  }
  SequenceTruth truth_;
};

// Compares steps of at least 0.3 m per frame in the world with the object's own z axis.
TEST_P(Vkitti1Real, ObjectsMoveAlongTheirHeading) {
  std::vector<double> angles_deg;
  std::vector<double> tilts_deg;
  std::vector<double> tilts_offset_last_deg;  // for the yaw offset not applied before Rx and Rz
  const Eigen::Quaterniond back(Eigen::AngleAxisd(-vkitti_yaw_offset_rad, Eigen::Vector3d::UnitY()));
  const auto tilt_deg = [](const Eigen::Quaterniond& R_world_object) {
    const Eigen::Vector3d down = R_world_object * Eigen::Vector3d::UnitY();
    return std::atan2(std::hypot(down.x(), down.z()), down.y()) * 180 / std::numbers::pi;
  };
  for (const auto& [frame, list] : truth_.objects) {
    for (const ObjectTruth& object : list) {
      const SE3 T_world_object = *truth_.camera.pose(frame) * object.T_camera_object;
      tilts_deg.push_back(tilt_deg(T_world_object.rotation()));
      tilts_offset_last_deg.push_back(
          tilt_deg(truth_.camera.pose(frame)->rotation() * back * object.T_camera_object.rotation()));
      const ObjectTruth* next = truth_.find(frame + 1, object.id);
      if (next == nullptr) continue;
      const Eigen::Vector3d step = (*truth_.camera.pose(frame + 1) * next->T_camera_object).translation() -
                                   T_world_object.translation();
      if (step.norm() < 0.3) continue;
      const Eigen::Vector3d ahead = T_world_object.rotation() * Eigen::Vector3d::UnitZ();
      angles_deg.push_back(std::atan2(ahead.cross(step).norm(), ahead.dot(step)) * 180 / std::numbers::pi);
    }
  }
  RecordProperty("heading_median_deg", fmt::format("{:.4f}", upper_median(angles_deg)));
  RecordProperty("tilt_offset_last_deg", fmt::format("{:.3f}", upper_median(tilts_offset_last_deg)));
  RecordProperty("tilt_median_deg", fmt::format("{:.5f}", upper_median(tilts_deg)));
  EXPECT_GT(angles_deg.size(), 200u);
  EXPECT_LT(upper_median(angles_deg), 5.0);
  EXPECT_LT(upper_median(tilts_deg), 0.001);
  EXPECT_GT(upper_median(tilts_offset_last_deg), 2.0);
}

// Compares the projected corners of the 3-D box (f = 725, c = (620.5, 187)) with the 2-D box, which bounds
// the car's pixels: they agree to a few pixels, because the car fills its 3-D box.
TEST_P(Vkitti1Real, BoxesProjectOntoTheirRectangles) {
  const PinholeCamera camera{725, 725, 620.5, 187};
  std::vector<double> errors_px;
  for (const auto& [frame, list] : truth_.objects) {
    for (const ObjectTruth& o : list) {
      ImageBox box;
      bool in_front = true;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d p =
            o.T_camera_object * Eigen::Vector3d((corner & 1 ? 0.5 : -0.5) * o.size_m->x(),
                                                corner & 2 ? -o.size_m->y() : 0.0,
                                                (corner & 4 ? 0.5 : -0.5) * o.size_m->z());
        in_front = in_front && p.z() > 1;
        const Eigen::Vector2d pixel = camera.project(p);
        box.include(pixel.x(), pixel.y());
      }
      // Boxes at the border of the image are truncated there.
      if (!in_front || o.box->left < 1 || o.box->top < 1 || o.box->right > 1240 || o.box->bottom > 373)
        continue;
      errors_px.push_back(
          std::max({std::abs(box.left - o.box->left), std::abs(box.top - o.box->top),
                    std::abs(box.right - o.box->right), std::abs(box.bottom - o.box->bottom)}));
    }
  }
  RecordProperty("box_median_px", fmt::format("{:.3f}", upper_median(errors_px)));
  EXPECT_GT(errors_px.size(), 500u);
  EXPECT_LT(upper_median(errors_px), 4.0);
}

INSTANTIATE_TEST_SUITE_P(Worlds, Vkitti1Real, testing::Values("0001", "0002", "0018"));

TEST_F(Vkitti1Truths, RowsOfVersion2AreThoseOfVersion1) {
  SEXTANT_NEEDS_DATA("vkitti_1.3.1_text");
  InputLog inputs;
  const SequenceTruth truth =
      read_vkitti1_truth(real_data("vkitti_1.3.1_text"), "0018", "clone", inputs).truth;
  // Virtual KITTI 2.0.3, Scene18/clone/pose.txt, first row (docs/datasets.md): world_space_X, Y, Z and
  // rotation_world_space_y, next to camera-space numbers that equal those of 1.3.1.
  const SE3 T_world_object = *truth.camera.pose(25) * truth.find(25, 1)->T_camera_object;
  EXPECT_LT((T_world_object.translation() - Eigen::Vector3d(53.18796, -106, 79.85496)).norm(), 2e-4);
  const Eigen::Vector3d ahead = T_world_object.rotation() * Eigen::Vector3d::UnitZ();
  const double yaw_rad = 2.263542 + std::numbers::pi / 2;
  EXPECT_LT((ahead - Eigen::Vector3d(std::sin(yaw_rad), 0, std::cos(yaw_rad))).norm(), 1e-4);
}

}  // namespace

namespace {

constexpr Channels vkitti1_channels{.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
const std::string extrinsics_path = "vkitti_1.3.1_extrinsicsgt/0001_clone.txt";
const std::string objects_path = "vkitti_1.3.1_motgt/0001_clone.txt";
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
  EXPECT_TRUE(text_only->read(4, vkitti1_channels).depth_m.empty());
  text_only->check_files();
  remove(extrinsics_path);
  EXPECT_THAT(open_with(source_)->info().warnings,
              ElementsAre("world 0001 has no extrinsicsgt file, so there is no true camera motion"));
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
  expect_error(
      [&] {
        open_with(source_, {{"rate_hz", 0.0}});
      },
      "option source.vkitti1.rate_hz = 0: must be finite and > 0");
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
  EXPECT_EQ(sequence->read(4, vkitti1_channels).mask(250, 120), 3);
  EXPECT_EQ(sequence->truth().objects.size(), 4u);
}

TEST_F(Vkitti1Files, UnknownNamesAreErrors) {
  const std::string root = "vkitti1:" + root_.string();
  expect_error([&] { open_with(root + "_no#0001"); }, "_no: no such folder");
  expect_error([&] { open_with(root + "#0002"); }, "no world '0002' in it; available: 0001");
  expect_error([&] { open_with(root + "#0001/fogg"); },
               "world 0001 has no variation 'fogg' in it; available: clone");
  expect_error([&] { open_with(root); },
               "choose a world: vkitti1:" + root_.string() + "#<world>/<variation>; available: 0001");
  expect_error([&] { open_with("vkitti1:" + temp_.path().string() + "#0001"); },
               "no Virtual KITTI 1.3.1 in it");
  expect_error([&] { open_with(source_ + "@0-3"); }, "frames 0-3 are requested, but it has frames 3-6");
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
    expect_error([&] { sequence->read(4, vkitti1_channels); }, file(png(kind, 4)) + message);
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
  expect_error([&] { sequence->read(4, vkitti1_channels); },
               file(png("scenegt", 4)) + ": pixel (204, 100) has the colour ");
  put_lines(colors, {"Category(:id) r g b", "Van:65535 80 80 80"});
  expect_error([&] { open_with(source_); }, "track id 65535 is too large");
}

TEST_F(Vkitti1Files, BadText) {
  std::vector<std::string> rows = lines(extrinsics_path);
  const std::vector<std::string> good = rows;
  rows[2].replace(rows[2].find(' ') + 1, 3, "nan");
  rows[2] = "4 nan" + rows[2].substr(rows[2].find(' ', 3));
  put_lines(extrinsics_path, rows);
  expect_error([&] { open_with(source_); }, file(extrinsics_path) + ":3: expected a finite number");
  put_lines(extrinsics_path, {good[0], good[1], good[2], good[3]});
  expect_error([&] { open_with(source_); }, file(objects_path) + ": it has objects in frame 6, of which " +
                                                file(extrinsics_path) + " has no pose");
  remove(objects_path);
  expect_error([&] { open_with(source_); },
               "the extrinsics have no row of frame 6, of which there are files: take both");
  EXPECT_EQ(open_with(source_ + "@3-5")->info().last_frame, 5);
}

TEST_F(Vkitti1Files, BadObjects) {
  const std::vector<std::string> rows = lines(objects_path);
  put_lines(objects_path, {rows[0], rows[1], rows[1]});
  expect_error([&] { open_with(source_); }, file(objects_path) + ":3: track 2 appears twice in frame 3");
  std::string header = rows[0];
  header.replace(header.find("moving"), 6, "moves");
  put_lines(objects_path, {header, rows[1]});
  expect_error([&] { open_with(source_); }, file(objects_path) + ":1: the first row names no column moving");
}

}  // namespace

}  // namespace sextant
