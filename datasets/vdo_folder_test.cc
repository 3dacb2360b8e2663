#include "sextant/datasets/vdo_folder.h"

#include <cstdlib>
#include <cstring>
#include <numbers>

#include "sextant/datasets/codec/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

constexpr Channels kAll{.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};

std::unique_ptr<Sequence> open(const std::string& source, const Json& options = Json::object()) {
  SourceSpec spec = SourceSpec::parse(source);
  spec.options = options;
  return open_source(spec);
}

class VdoFolder : public testing::Test {
 protected:
  std::string source(const std::string& rest = "") const { return fixture_.source() + rest; }
  std::string file(const std::string& name) const { return (fixture_.dir / name).string(); }
  void replace(const std::string& name, std::string_view bytes) { write_file(fixture_.dir / name, bytes); }

  TempFolder temp_;
  VdoFixture fixture_ = make_vdo_fixture(temp_.path() / "tiny");
};

TEST_F(VdoFolder, InfoSaysWhatIsThere) {
  const auto sequence = open(source());
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(info.dataset, "vdo");
  EXPECT_EQ(info.sequence, "tiny");
  EXPECT_EQ(info.first_frame, 0);
  EXPECT_EQ(info.last_frame, 4);
  EXPECT_EQ(info.width, 320);
  EXPECT_EQ(info.height, 96);
  EXPECT_EQ(info.rate_hz, 10);
  EXPECT_EQ(info.camera.left.fx, 200);
  EXPECT_EQ(info.camera.bf, 200);
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_EQ(open(source("/"))->info().sequence, "tiny");
  EXPECT_EQ(open(source("#03@1-3"))->info().sequence, "03");
  EXPECT_EQ(open(source("#03@1-3"))->info().last_frame, 3);
  sequence->check_files();
}

TEST_F(VdoFolder, ReadsOnlyTheChannelsAskedFor) {
  const auto sequence = open(source());
  const Frame depth = sequence->read(2, {.depth = true});
  EXPECT_EQ(depth.index, 2);
  EXPECT_FALSE(depth.depth_m.empty());
  EXPECT_TRUE(depth.gray.empty() && depth.rgb.empty() && depth.flow.empty() && depth.mask.empty());
  const Frame all = sequence->read(2, kAll);
  EXPECT_EQ(all.gray, rgb_to_gray(all.rgb));
  EXPECT_EQ(all.gray, sequence->read(2, {.gray = true}).gray);
  EXPECT_TRUE(sequence->read(4, kAll).flow.empty());
}

TEST_F(VdoFolder, OptionsReplaceItsOwnChannels) {
  const auto own = open(source());
  const auto same = open(source(), {{"flow", "flo:" + file("flow")},
                                    {"depth", "disparity256:" + file("depth")},
                                    {"masks", "vdo_text:" + file("semantic")}});
  EXPECT_THAT(same->info().provenance,
              testing::ElementsAre("depth: disparity256:" + file("depth"), "flow: flo:" + file("flow"),
                                   "masks: vdo_text:" + file("semantic")));
  same->check_files();
  for (const int k : {1, 4}) {
    const Frame a = own->read(k, kAll), b = same->read(k, kAll);
    EXPECT_EQ(a.mask, b.mask);
    EXPECT_EQ(std::memcmp(a.depth_m.data(), b.depth_m.data(), a.depth_m.size() * sizeof(float)), 0);
    ASSERT_EQ(a.flow.size(), b.flow.size());
    EXPECT_EQ(a.flow.empty(), k == 4);
    EXPECT_TRUE(a.flow.empty() ||
                std::memcmp(a.flow.data(), b.flow.data(), a.flow.size() * sizeof(Flow)) == 0);
  }
  std::filesystem::remove(file("flow/000002.flo"));
  expect_error([&] { own->check_files(); }, file("flow/000002.flo") + ": missing file");
  open(source(), {{"flow", "dis"}})->check_files();
  expect_error(
      [&] {
        open(source(), {{"flow", "flo:" + file("flow")}})->check_files();
      },
      file("flow") + ": frame 2 needs its flow");
}

TEST_F(VdoFolder, OptionsComputeChannels) {
  const auto own = open(source());
  const auto computed = open(source(), {{"flow", "dis"}, {"masks", "boxes"}});
  const Frame truth = own->read(1, kAll), frame = computed->read(1, kAll);
  int n_same = 0, n_object = 0, n_near = 0, n_flow = 0;
  for (size_t i = 0; i < truth.mask.size(); ++i) {
    n_object += truth.mask.data()[i] == 1;
    n_same += truth.mask.data()[i] == 1 && frame.mask.data()[i] == 1;
    const Flow a = truth.flow.data()[i], b = frame.flow.data()[i];
    if (!a.valid()) continue;
    ++n_flow;
    n_near += std::hypot(a.u - b.u, a.v - b.v) < 1;
  }
  EXPECT_GT(n_object, 0);
  EXPECT_EQ(n_same, n_object);  // a box holds its object
  EXPECT_GT(n_near, 0.6 * n_flow);
  EXPECT_TRUE(computed->read(4, kAll).flow.empty());
  expect_error([&] { open(source(), {{"depth", "sgbm"}}); }, "depth: sgbm needs the right images");
  expect_error(
      [&] {
        open(source(), {{"flow", "diss"}});
      },
      "flow: unknown choice 'diss': did you mean 'dis'?");
}

TEST_F(VdoFolder, LogsWhatItRead) {
  const auto sequence = open(source());
  EXPECT_FALSE(sequence->inputs().entries().contains(file("flow/000001.flo")));
  sequence->read(1, kAll);
  const auto entries = sequence->inputs().entries();
  for (const char* name : {"camera.yaml", "pose_gt.txt", "object_pose.txt", "times.txt", "image_0/000001.png",
                           "depth/000001.png", "flow/000001.flo", "semantic/000001.txt"}) {
    ASSERT_TRUE(entries.contains(file(name))) << name;
    EXPECT_EQ(entries.at(file(name)).sha256, sha256(read_file(file(name))));
  }
}

TEST_F(VdoFolder, TruthIsThatOfTheScene) {
  const auto sequence = open(source());
  for (const auto& [frame, T_world_camera] : fixture_.T_world_camera) {
    const auto pose = sequence->truth().camera.pose(frame);
    ASSERT_TRUE(pose.has_value());
    EXPECT_LT((pose->inverse() * T_world_camera).log().norm(), 1e-12);
    const ObjectTruth* object = sequence->truth().find(frame, 1);
    ASSERT_NE(object, nullptr);
    const SE3 expected = T_world_camera.inverse() * fixture_.T_world_object.at(frame);
    EXPECT_LT((object->T_camera_object.inverse() * expected).log().norm(), 1e-12);
    EXPECT_FALSE(object->interpolated);
  }
}

// The sign and order conventions of all files at once: depth, true motion and flow must agree at every pixel.
TEST_F(VdoFolder, FlowIsDepthMovedByTheTruth) {
  const auto sequence = open(source());
  const PinholeCamera& camera = sequence->info().camera.left;
  for (int k = 0; k < 4; ++k) {
    const Frame frame = sequence->read(k, kAll);
    const SE3 background = sequence->truth().background_motion(k, k + 1).value();
    const SE3 object = sequence->truth().object_motion(1, k, k + 1).value();
    int n_object = 0;
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 320; ++x) {
        n_object += frame.mask(x, y) == 1;
        if (!frame.flow(x, y).valid()) continue;
        ASSERT_TRUE(std::isfinite(frame.depth_m(x, y)));
        const SE3& motion = frame.mask(x, y) == 1 ? object : background;
        const Eigen::Vector2d p = camera.project(motion * camera.backproject(x, y, frame.depth_m(x, y)));
        ASSERT_NEAR(p.x(), x + frame.flow(x, y).u, 0.02) << k << ": " << x << ", " << y;
        ASSERT_NEAR(p.y(), y + frame.flow(x, y).v, 0.02) << k << ": " << x << ", " << y;
      }
    }
    EXPECT_GT(n_object, 320 * 96 / 50);
  }
}

TEST_F(VdoFolder, OptionsOverrideTheFolder) {
  const auto sequence = open(source(), {{"rate_hz", 5.0}, {"fx", 210.0}, {"bf", 190.0}});
  EXPECT_EQ(sequence->info().rate_hz, 5);
  EXPECT_EQ(sequence->info().camera.left.fx, 210);
  EXPECT_EQ(sequence->info().camera.left.fy, 200);
  EXPECT_EQ(sequence->info().camera.bf, 190);
  ASSERT_EQ(sequence->info().warnings.size(), 1u);
  EXPECT_THAT(sequence->info().warnings[0], testing::HasSubstr("steps of 0.1 s, but the rate is 5 Hz"));
  expect_error([&] { open(source(), {{"bf", -1.0}}); }, "option bf = -1");
  expect_error(
      [&] {
        open(source(), {{"bf_preset", "gray"}});
      },
      "option bf_preset = gray: must be authors or colour");
  expect_error(
      [&] {
        open(source(), {{"bf_preset", "colour"}});
      },
      "option bf_preset = colour is that of KITTI 0003");
  expect_error(
      [&] {
        open(source(), {{"rate_hs", 5}});
      },
      "unknown option key 'vdo.rate_hs': did you mean 'rate_hz'");
}

TEST_F(VdoFolder, MissingTruthIsAWarning) {
  fs::remove(file("pose_gt.txt"));
  fs::remove(file("object_pose.txt"));
  const auto sequence = open(source());
  EXPECT_EQ(sequence->info().warnings.size(), 2u);
  EXPECT_TRUE(sequence->truth().camera.empty());
  EXPECT_TRUE(sequence->truth().objects.empty());
}

TEST_F(VdoFolder, FramesWithoutAPoseAreAWarning) {
  replace("pose_gt.txt", encode_pose_text({{0, SE3()}, {1, SE3()}}));
  EXPECT_THAT(open(source())->info().warnings,
              testing::ElementsAre(testing::HasSubstr("no pose for 3 of 5 frames")));
}

TEST_F(VdoFolder, AnAssumedRateIsTold) {
  fs::remove(file("camera.yaml"));
  fs::remove(file("times.txt"));
  Json camera = {{"fx", 200.0}, {"fy", 200.0}, {"cx", 159.5}, {"cy", 47.5}, {"bf", 200.0}};
  EXPECT_THAT(open(source(), camera)->info().warnings,
              testing::ElementsAre(testing::HasSubstr("10 Hz are assumed")));
  camera["rate_hz"] = 10.0;
  EXPECT_THAT(open(source(), camera)->info().warnings, testing::IsEmpty());
}

TEST_F(VdoFolder, WithoutYamlOnlyTheDemosSizeHasACamera) {
  fs::remove(file("camera.yaml"));
  expect_error([&] { open(source()); }, fixture_.dir.string() + ": no *.yaml camera in this folder");
  const Json camera = {{"fx", 200.0}, {"fy", 200.0}, {"cx", 159.5}, {"cy", 47.5}, {"bf", 200.0}};
  EXPECT_EQ(open(source(), camera)->info().camera.left.cx, 159.5);
  for (int k = 0; k < 5; ++k) {
    replace(fmt::format("image_0/{:06}.png", k), encode_png(Image<uint8_t>(1242, 375)));
  }
  const auto sequence = open(source());
  EXPECT_EQ(sequence->info().camera.left.fx, 721.5377);
  EXPECT_EQ(sequence->info().rate_hz, 10);
  EXPECT_THAT(sequence->info().warnings,
              testing::ElementsAre(testing::HasSubstr("using the KITTI 0003 demo's f = 721.5377")));
  EXPECT_EQ(open(source(), {{"bf_preset", "colour"}})->info().camera.bf, 384.3814);
}

TEST_F(VdoFolder, TwoYamlFilesAreAnError) {
  replace("other.yaml", "%YAML:1.0\n");
  expect_error([&] { open(source()); }, ": 2 camera files (such as camera.yaml and other.yaml)");
}

TEST_F(VdoFolder, MissingFolders) {
  expect_error([&] { open(source("_not_here")); }, fixture_.dir.string() + "_not_here: no such folder");
  fs::rename(file("image_0"), file("image"));
  EXPECT_EQ(open(source())->info().last_frame, 4);
  fs::remove_all(file("image"));
  expect_error([&] { open(source()); }, fixture_.dir.string() + ": no folder image_0 or image");
  fs::create_directory(file("image"));
  expect_error([&] { open(source()); }, file("image") + ": no images named like 000000.png");
}

TEST_F(VdoFolder, AMissingFileOfAFrame) {
  for (const auto& [name, what] : {std::pair{"depth/000002.png", "depth"},
                                   {"flow/000002.flo", "flow"},
                                   {"semantic/000002.txt", "mask"}}) {
    const std::string bytes = read_file(file(name));
    fs::remove(file(name));
    const auto sequence = open(source());
    expect_error([&] { sequence->check_files(); },
                 fmt::format("{}: missing file: frame 2 needs its {}", file(name), what));
    expect_error([&] { sequence->read(2, kAll); }, file(name));
    replace(name, bytes);
  }
}

TEST_F(VdoFolder, AGapInTheImages) {
  fs::remove(file("image_0/000002.png"));
  expect_error([&] { open(source()); }, file("image_0") + ": frame 2 is missing between 0 and 4");
  EXPECT_EQ(open(source("@3-4"))->info().first_frame, 3);
}

TEST_F(VdoFolder, FrameRangeBeyondTheData) {
  expect_error([&] { open(source("@0-25")); },
               file("image_0") + ": frames 0-25 asked for, it has frames 0-4");
  expect_error([&] { open(source("@7-9")); }, "it has frames 0-4");
  const auto sequence = open(source("@1-3"));
  expect_error([&] { sequence->read(4, kAll); }, "no frame 4: it has frames 1-3");
  EXPECT_FALSE(sequence->read(3, kAll).flow.empty());
}

TEST_F(VdoFolder, DamagedFiles) {
  const auto sequence = open(source());
  const std::string depth = read_file(file("depth/000001.png"));
  replace("depth/000001.png", depth.substr(0, depth.size() / 2));
  expect_error([&] { sequence->read(1, kAll); }, file("depth/000001.png") + ": PNG file is truncated");
  replace("depth/000001.png", depth);

  const std::string flow = read_file(file("flow/000001.flo"));
  replace("flow/000001.flo", "XXXX" + flow.substr(4));
  expect_error([&] { sequence->read(1, kAll); }, file("flow/000001.flo") + ": not a Middlebury .flo file");
  replace("flow/000001.flo", flow.substr(0, 1000));
  expect_error([&] { sequence->read(1, kAll); }, file("flow/000001.flo") + ": .flo file is truncated");
  replace("flow/000001.flo", flow);

  replace("semantic/000001.txt", "0 0 car 0\n");
  expect_error([&] { sequence->read(1, kAll); },
               file("semantic/000001.txt") + ":1:5: expected an instance id");
}

TEST_F(VdoFolder, FilesOfAnotherSize) {
  const auto sequence = open(source());
  const auto error = [&](const std::string& name, const std::string& bytes, const char* size) {
    const std::string good = read_file(file(name));
    replace(name, bytes);
    expect_error([&] { sequence->read(1, kAll); }, fmt::format("{}: {} pixels, but {} has 320x96", file(name),
                                                               size, file("image_0/000000.png")));
    replace(name, good);
  };
  error("semantic/000001.txt", encode_mask_text(Image<uint16_t>(320, 95)), "320x95");
  error("flow/000001.flo", encode_flo(Image<Flow>(319, 96)), "319x96");
  error("depth/000001.png", encode_png(Image<uint16_t>(160, 48)), "160x48");
  error("image_0/000001.png", encode_png(Image<Rgb>(32, 9)), "32x9");
}

TEST_F(VdoFolder, BadPoseRows) {
  replace("pose_gt.txt", "0 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n1 1 0 0 0 0 1 0 0 0 0 1 0 0 0\n");
  expect_error([&] { open(source()); },
               file("pose_gt.txt") + ":2: expected frame number + 16 values, got 15");
  replace("pose_gt.txt", "0 1 0 0 nan 0 1 0 0 0 0 1 0 0 0 0 1\n");
  expect_error([&] { open(source()); }, file("pose_gt.txt") + ":1: expected a finite number");
}

class VdoDemo : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("SEXTANT_DATA");
    if (data == nullptr) GTEST_SKIP() << "set SEXTANT_DATA to the folder that holds kitti_03_demo";
    source_ = (fs::path(data) / "kitti_03_demo").string();
    if (!fs::is_directory(source_)) GTEST_SKIP() << source_ << " is not there";
    source_ = "vdo:" + source_;
  }
  std::string source_;
};

TEST_F(VdoDemo, OpensWithItsTwoWarnings) {
  const auto sequence = open(source_);
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(info.first_frame, 0);
  EXPECT_EQ(info.last_frame, 19);
  EXPECT_EQ(info.rate_hz, 10);
  EXPECT_THAT(info.warnings,
              testing::ElementsAre(testing::HasSubstr("no *.yaml camera in"),
                                   testing::HasSubstr("steps of 0.05 s, but the rate is 10 Hz")));
  sequence->check_files();
  EXPECT_EQ(sequence->truth().camera.poses().size(), 144u);
  expect_error([&] { open(source_ + "@0-143"); }, "it has frames 0-19");
}

TEST_F(VdoDemo, TruthIsThatOfACarInTraffic) {
  const auto sequence = open(source_);
  const SE3 motion = sequence->truth().background_motion(0, 1).value();
  EXPECT_NEAR(motion.translation().z(), -1.18, 0.02);  // drives ahead: the world comes nearer
  const ObjectTruth* wagon = sequence->truth().find(1, 1);
  ASSERT_NE(wagon, nullptr);
  EXPECT_TRUE(wagon->interpolated);
  EXPECT_LT(rotation_angle_rad(wagon->T_camera_object.rotation()), 0.05);
  const double step_m =
      (sequence->truth().camera.pose(1).value() * wagon->T_camera_object.translation() -
       sequence->truth().camera.pose(0).value() * sequence->truth().find(0, 1)->T_camera_object.translation())
          .norm();
  EXPECT_NEAR(step_m * 36, 54, 6);  // km/h
}

// Measured depth moved by the true motion, against the measured flow (23 px in the median). The true steps
// jitter by 3 to 6 % (the oxts sample is not taken at the image), which leaves 2.4 px here; a wrong sign or
// order leaves 44 px.
TEST_F(VdoDemo, FlowDepthAndTruthAgree) {
  const auto sequence = open(source_);
  const Frame frame = sequence->read(0, kAll);
  const PinholeCamera& camera = sequence->info().camera.left;
  const SE3 motion = sequence->truth().background_motion(0, 1).value();
  const auto median_error_px = [&](const SE3& T_curr_prev) {
    std::vector<double> errors;
    for (int y = 0; y < 375; y += 3) {
      for (int x = 0; x < 1242; x += 3) {
        if (frame.mask(x, y) != 0 || !(frame.depth_m(x, y) < 40) || !frame.flow(x, y).valid()) continue;
        const Eigen::Vector2d p = camera.project(T_curr_prev * camera.backproject(x, y, frame.depth_m(x, y)));
        errors.push_back((p - Eigen::Vector2d(x + frame.flow(x, y).u, y + frame.flow(x, y).v)).norm());
      }
    }
    EXPECT_GT(errors.size(), 10000u);
    std::ranges::nth_element(errors, errors.begin() + static_cast<long>(errors.size()) / 2);
    return errors[errors.size() / 2];
  };
  EXPECT_LT(median_error_px(motion), 3.0);
  EXPECT_GT(median_error_px(motion.inverse()), 30.0);
}

}  // namespace
}  // namespace sextant
