#include <cstring>

#include "sextant/base/quantile.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/testing.h"
#include "sextant/datasets/vdo_folder.h"
#include "sextant/datasets/vdo_folder_testing.h"

namespace sextant {
namespace {

class VdoLayoutTest : public testing::Test {
 protected:
  VdoLayoutTest() {
    make_vdo_fixture(folder_.path() / "a", {.n_frames = 3, .first_frame = 7, .width = 64, .height = 32});
  }

  std::unique_ptr<Sequence> open(const std::string& name) const {
    return open_source(SourceSpec::parse("vdo:" + (folder_.path() / name).string()));
  }
  std::string write(const Sequence& sequence, const std::string& name, int jobs = 1) const {
    LayoutRequest request{.out = folder_.path() / name, .jobs = jobs, .quiet = true};
    return find_layout("vdo").write(sequence, request);
  }

  TempFolder folder_;
};

TEST_F(VdoLayoutTest, EverythingComesBack) {
  const auto before = open("a");
  const std::string source = write(*before, "b", 2);
  const auto after = open_source(SourceSpec::parse(source));
  EXPECT_EQ(after->info().first_frame, 7);
  EXPECT_EQ(after->info().last_frame, 9);
  EXPECT_EQ(after->info().camera.bf, before->info().camera.bf);
  EXPECT_EQ(after->info().camera.left.fx, before->info().camera.left.fx);
  EXPECT_EQ(after->info().rate_hz, before->info().rate_hz);
  for (int frame = 7; frame <= 9; ++frame) {
    const Channels channels{.rgb = true, .depth = true, .flow = true, .mask = true};
    const Frame a = before->read(frame, channels), b = after->read(frame, channels);
    EXPECT_EQ(a.rgb, b.rgb);
    EXPECT_EQ(a.mask, b.mask);
    ASSERT_EQ(a.flow.size(), b.flow.size());
    for (size_t i = 0; i < a.flow.size(); ++i) EXPECT_EQ(a.flow.data()[i].u, b.flow.data()[i].u);
    for (size_t i = 0; i < a.depth_m.size(); ++i) {
      const float z = a.depth_m.data()[i];
      if (std::isfinite(z)) {
        EXPECT_EQ(z, b.depth_m.data()[i]);
      }
    }
    const auto pose = after->truth().camera.pose(frame);
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->inverse() * *before->truth().camera.pose(frame)).log().norm(), 1e-12);
    const ObjectTruth* object = after->truth().find(frame, 1);
    ASSERT_NE(object, nullptr);
    EXPECT_LT(
        (object->T_camera_object.inverse() * before->truth().find(frame, 1)->T_camera_object).log().norm(),
        1e-9);
    EXPECT_EQ(object->box, before->truth().find(frame, 1)->box);
  }
}

TEST_F(VdoLayoutTest, TimesAreThoseOfTheRate) {
  write(*open("a"), "b");
  EXPECT_TRUE(open("b")->info().warnings.empty()) << open("b")->info().warnings.front();
  EXPECT_NEAR(open("b")->info().times_s.at(8), 0.8, 1e-12);
}

TEST_F(VdoLayoutTest, NothingIsOverwritten) {
  write(*open("a"), "b");
  expect_error([&] { write(*open("a"), "b"); }, "exists already");
}

}  // namespace

namespace {

constexpr Channels vdo_channels{.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};

class VdoFolder : public FolderTest {
 protected:
  VdoFolder() : FolderTest("tiny") {}
  std::string source(const std::string& rest = "") const { return fixture_.source() + rest; }

  VdoFixture fixture_ = make_vdo_fixture(root_);
};

TEST_F(VdoFolder, InfoSaysWhatIsThere) {
  const auto sequence = open_with(source());
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(text_of(info), "vdo tiny@0-4, 320x96 px, 10 Hz");
  EXPECT_EQ(info.camera.left.fx, 200);
  EXPECT_EQ(info.camera.bf, 200);
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_EQ(open_with(source("/"))->info().sequence, "tiny");
  EXPECT_EQ(open_with(source("#03@1-3"))->info().sequence, "03");
  EXPECT_EQ(open_with(source("#03@1-3"))->info().last_frame, 3);
  sequence->check_files();
}

TEST_F(VdoFolder, OptionsReplaceItsOwnChannels) {
  const auto own = open_with(source());
  const auto same = open_with(source(), {{"flow", "flo:" + file("flow")},
                                         {"depth", "disparity256:" + file("depth")},
                                         {"masks", "vdo_text:" + file("semantic")}});
  EXPECT_THAT(same->info().provenance,
              ElementsAre("depth: disparity256:" + file("depth"), "flow: flo:" + file("flow"),
                          "masks: vdo_text:" + file("semantic")));
  same->check_files();
  for (const int k : {1, 4}) {
    const Frame a = own->read(k, vdo_channels), b = same->read(k, vdo_channels);
    EXPECT_EQ(a.mask, b.mask);
    EXPECT_EQ(std::memcmp(a.depth_m.data(), b.depth_m.data(), a.depth_m.size() * sizeof(float)), 0);
    ASSERT_EQ(a.flow.size(), b.flow.size());
    EXPECT_EQ(a.flow.empty(), k == 4);
    EXPECT_TRUE(a.flow.empty() ||
                std::memcmp(a.flow.data(), b.flow.data(), a.flow.size() * sizeof(Flow)) == 0);
  }
  fs::remove(file("flow/000002.flo"));
  expect_error([&] { open_with(source())->check_files(); }, file("flow/000002.flo") + ": missing file");
  open_with(source(), {{"flow", "dis"}})->check_files();
  fs::remove_all(file("flow"));
  expect_error([&] { open_with(source()); }, file("flow") + ": no such folder");
  open_with(source(), {{"flow", "dis"}})->check_files();
}

TEST_F(VdoFolder, OptionsComputeChannels) {
  const auto own = open_with(source());
  const auto computed = open_with(source(), {{"flow", "dis"}, {"masks", "boxes"}});
  const Frame truth = own->read(1, vdo_channels), frame = computed->read(1, vdo_channels);
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
  EXPECT_EQ(n_same, n_object);  // the box contains its object
  EXPECT_GT(n_near, 0.6 * n_flow);
  EXPECT_TRUE(computed->read(4, vdo_channels).flow.empty());
  expect_error([&] { open_with(source(), {{"depth", "sgbm"}}); }, "depth: sgbm needs the right images");
  expect_error(
      [&] {
        open_with(source(), {{"flow", "diss"}});
      },
      "flow: unknown choice 'diss': did you mean 'dis'?");
}

TEST_F(VdoFolder, TruthIsThatOfTheScene) {
  const auto sequence = open_with(source());
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

// Tests the sign and order conventions of all files together: depth, true motion and flow must agree at every
// pixel.
TEST_F(VdoFolder, FlowIsDepthMovedByTheTruth) {
  const auto sequence = open_with(source());
  const PinholeCamera& camera = sequence->info().camera.left;
  for (int k = 0; k < 4; ++k) {
    const Frame frame = sequence->read(k, vdo_channels);
    const SE3 background = sequence->truth().background_motion(k, k + 1).value();
    const SE3 object = sequence->truth().object_motion(1, k, k + 1).value();
    int n_object = 0;
    for (const auto [x, y] : PixelRange(320, 96)) {
      n_object += frame.mask(x, y) == 1;
      if (!frame.flow(x, y).valid()) continue;
      ASSERT_TRUE(std::isfinite(frame.depth_m(x, y)));
      const SE3& motion = frame.mask(x, y) == 1 ? object : background;
      const Eigen::Vector2d p = camera.project(motion * camera.backproject(x, y, frame.depth_m(x, y)));
      ASSERT_NEAR(p.x(), x + frame.flow(x, y).u, 0.02) << k << ": " << x << ", " << y;
      ASSERT_NEAR(p.y(), y + frame.flow(x, y).v, 0.02) << k << ": " << x << ", " << y;
    }
    EXPECT_GT(n_object, 320 * 96 / 50);
  }
}

TEST_F(VdoFolder, OptionsOverrideTheFolder) {
  const auto sequence = open_with(source(), {{"rate_hz", 5.0}, {"fx", 210.0}, {"bf", 190.0}});
  EXPECT_EQ(sequence->info().rate_hz, 5);
  EXPECT_EQ(sequence->info().camera.left.fx, 210);
  EXPECT_EQ(sequence->info().camera.left.fy, 200);
  EXPECT_EQ(sequence->info().camera.bf, 190);
  ASSERT_EQ(sequence->info().warnings.size(), 1u);
  EXPECT_THAT(sequence->info().warnings[0], HasSubstr("steps of 0.1 s, but the rate is 5 Hz"));
  expect_error([&] { open_with(source(), {{"bf", -1.0}}); }, "option source.vdo.bf = -1");
  expect_error(
      [&] {
        open_with(source(), {{"bf_preset", "gray"}});
      },
      "option source.vdo.bf_preset = gray: known: authors, colour");
  expect_error(
      [&] {
        open_with(source(), {{"bf_preset", "colour"}});
      },
      "option bf_preset = colour is that of KITTI 0003");
  expect_error(
      [&] {
        open_with(source(), {{"rate_hs", 5}});
      },
      "unknown option key 'source.vdo.rate_hs': did you mean 'rate_hz'");
}

TEST_F(VdoFolder, MissingTruthIsAWarning) {
  fs::remove(file("pose_gt.txt"));
  fs::remove(file("object_pose.txt"));
  const auto sequence = open_with(source());
  EXPECT_EQ(sequence->info().warnings.size(), 2u);
  EXPECT_TRUE(sequence->truth().camera.empty());
  EXPECT_TRUE(sequence->truth().objects.empty());
}

TEST_F(VdoFolder, FramesWithoutAPoseAreAWarning) {
  put("pose_gt.txt", encode_pose_text({{0, SE3()}, {1, SE3()}}));
  EXPECT_THAT(open_with(source())->info().warnings, ElementsAre(HasSubstr("no pose for 3 of 5 frames")));
}

TEST_F(VdoFolder, ObjectsOfOtherFramesAreAWarning) {
  const std::string row = " 1 0 0 9 9 1 1.5 10 0\n";
  put("object_pose.txt", "100" + row + "104" + row);
  EXPECT_THAT(
      open_with(source("@0-1"))->info().warnings,
      ElementsAre(HasSubstr("its rows are of the frames 100 to 104, but the images are of the frames 0 "
                            "to 4, so there is no true object motion")));
  put("object_pose.txt", "4" + row);
  EXPECT_THAT(open_with(source("@0-1"))->info().warnings, IsEmpty());
}

TEST_F(VdoFolder, AnotherNumberOfTimesThanImagesIsAWarning) {
  const char* const warning = "lines for the frames 0 to 4, of which each needs one";
  put("times.txt", "0\n0.1\n0.2\n0.3\n0.4\n");
  EXPECT_THAT(open_with(source("@0-1"))->info().warnings, IsEmpty());
  put("times.txt", "0\n0.1\n0.2\n0.3\n");
  EXPECT_THAT(open_with(source("@0-1"))->info().warnings, ElementsAre(HasSubstr(warning)));
  put("times.txt", "0\n0.1\n0.2\n0.3\n0.4\n0.5\n");
  EXPECT_THAT(open_with(source())->info().warnings, ElementsAre(HasSubstr(warning)));
  std::map<int, SE3> poses;
  for (int k = 0; k < 9; ++k) poses[k] = SE3();
  put("pose_gt.txt", encode_pose_text(poses));  // of a longer sequence
  EXPECT_THAT(open_with(source())->info().warnings, IsEmpty());
}

TEST_F(VdoFolder, DistortionAndAnotherDepthFactorAreWarnings) {
  const std::string camera = read_file(file("camera.yaml"));
  put("camera.yaml", camera + "Camera.k1: 0\nDepthMapFactor: 256\n");
  EXPECT_THAT(open_with(source())->info().warnings, IsEmpty());
  put("camera.yaml", camera + "Camera.k1: -0.35\nCamera.p2: 0.001\nDepthMapFactor: 5000\n");
  EXPECT_THAT(open_with(source())->info().warnings,
              ElementsAre(HasSubstr("the lens distortion Camera.k1 = -0.35, Camera.p2 = 0.001 is not used"),
                          HasSubstr("DepthMapFactor = 5000 is not used: depth is read as disparity256")));
}

TEST_F(VdoFolder, AnAssumedRateIsAWarning) {
  fs::remove(file("camera.yaml"));
  fs::remove(file("times.txt"));
  Json camera = {{"fx", 200.0}, {"fy", 200.0}, {"cx", 159.5}, {"cy", 47.5}, {"bf", 200.0}};
  EXPECT_THAT(open_with(source(), camera)->info().warnings, ElementsAre(HasSubstr("assuming 10 Hz")));
  camera["rate_hz"] = 10.0;
  EXPECT_THAT(open_with(source(), camera)->info().warnings, IsEmpty());
}

TEST_F(VdoFolder, WithoutYamlOnlyTheDemosSizeHasACamera) {
  fs::remove(file("camera.yaml"));
  expect_error([&] { open_with(source()); }, fixture_.dir.string() + ": no *.yaml camera in this folder");
  const Json camera = {{"fx", 200.0}, {"fy", 200.0}, {"cx", 159.5}, {"cy", 47.5}, {"bf", 200.0}};
  EXPECT_EQ(open_with(source(), camera)->info().camera.left.cx, 159.5);
  for (int k = 0; k < 5; ++k) {
    put(fmt::format("image_0/{:06}.png", k), encode_png(Image<uint8_t>(1242, 375)));
  }
  const auto sequence = open_with(source());
  EXPECT_EQ(sequence->info().camera.left.fx, 721.5377);
  EXPECT_EQ(sequence->info().rate_hz, 10);
  EXPECT_THAT(sequence->info().warnings, ElementsAre(HasSubstr("using the KITTI 0003 demo's f = 721.5377")));
  EXPECT_EQ(open_with(source(), {{"bf_preset", "colour"}})->info().camera.bf, 384.3814);
}

TEST_F(VdoFolder, TwoYamlFilesAreAnError) {
  put("other.yaml", "%YAML:1.0\n");
  expect_error([&] { open_with(source()); }, ": 2 camera files (such as camera.yaml and other.yaml)");
}

TEST_F(VdoFolder, MissingFolders) {
  expect_error([&] { open_with(source("_not_here")); }, fixture_.dir.string() + "_not_here: no such folder");
  fs::rename(file("image_0"), file("image"));
  EXPECT_EQ(open_with(source())->info().last_frame, 4);
  fs::remove_all(file("image"));
  expect_error([&] { open_with(source()); }, fixture_.dir.string() + ": no folder image_0 or image");
  fs::create_directory(file("image"));
  expect_error([&] { open_with(source()); },
               file("image") + ": no .png or .jpg files named by frame number in it");
}

TEST_F(VdoFolder, AGapInTheImages) {
  fs::remove(file("image_0/000002.png"));
  expect_error([&] { open_with(source()); }, file("image_0") + ": frame 2 is missing between 0 and 4");
  EXPECT_EQ(open_with(source("@3-4"))->info().first_frame, 3);
  EXPECT_FALSE(
      open_with(source("@0-1"))->read(1, vdo_channels).flow.empty());  // the last requested frame has flow
}

TEST_F(VdoFolder, BadPoseRows) {
  put("pose_gt.txt", "0 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n1 1 0 0 0 0 1 0 0 0 0 1 0 0 0\n");
  expect_error([&] { open_with(source()); },
               file("pose_gt.txt") + ":2: expected frame number + 16 values, got 15");
  put("pose_gt.txt", "0 1 0 0 nan 0 1 0 0 0 0 1 0 0 0 0 1\n");
  expect_error([&] { open_with(source()); }, file("pose_gt.txt") + ":1: expected a finite number");
}

class VdoDemo : public testing::Test {
 protected:
  void SetUp() override { SEXTANT_NEEDS_DATA("kitti_03_demo"); }
  const std::string source_ = "vdo:" + real_data("kitti_03_demo").string();
};

TEST_F(VdoDemo, OpensWithItsTwoWarnings) {
  const auto sequence = open_with(source_);
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(info.first_frame, 0);
  EXPECT_EQ(info.last_frame, 19);
  EXPECT_EQ(info.rate_hz, 10);
  EXPECT_THAT(info.warnings, ElementsAre(HasSubstr("no *.yaml camera in"),
                                         HasSubstr("steps of 0.05 s, but the rate is 10 Hz")));
  sequence->check_files();
  EXPECT_EQ(sequence->truth().camera.poses().size(), 144u);
  expect_error([&] { open_with(source_ + "@0-143"); }, "it has frames 0-19");
}

TEST_F(VdoDemo, TruthIsThatOfACarInTraffic) {
  const auto sequence = open_with(source_);
  const SE3 motion = sequence->truth().background_motion(0, 1).value();
  EXPECT_NEAR(motion.translation().z(), -1.18, 0.02);  // drives ahead: the world approaches
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

// Compares measured depth moved by the true motion with the measured flow (23 px in the median). The true
// steps jitter by 3 to 6 % (oxts samples are not taken at the images), which leaves 2.4 px here; a wrong sign
// or order leaves 44 px.
TEST_F(VdoDemo, FlowDepthAndTruthAgree) {
  const auto sequence = open_with(source_);
  const Frame frame = sequence->read(0, vdo_channels);
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
    return upper_median(errors);
  };
  EXPECT_LT(median_error_px(motion), 3.0);
  EXPECT_GT(median_error_px(motion.inverse()), 30.0);
}

}  // namespace

namespace {

TEST(VdoObjects, ReadsBoxPoseAndOrder) {
  const ObjectTruths objects = decode_vdo_objects(
      "0\t3\t2.9e+02\t177\t331.5\t197\t-21.4\t1.7\t51.9\t0\n"
      "0\t1\t894.7\t190.6\t1241\t374\t3.4\t1.5\t4.7\t-1.5707963267948966\n",
      "object_pose.txt");
  ASSERT_EQ(objects.at(0).size(), 2u);
  const ObjectTruth& first = objects.at(0)[0];
  EXPECT_EQ(first.id, 1);
  EXPECT_EQ(first.box, (ImageBox{894.7, 190.6, 1241, 374}));
  EXPECT_FALSE(first.moving.has_value());
  // ry = -pi/2 is heading ahead: the axes of the camera.
  EXPECT_LT(rotation_angle_rad(first.T_camera_object.rotation()), 1e-12);
  EXPECT_EQ(first.T_camera_object.translation(), Eigen::Vector3d(3.4, 1.5, 4.7));
  // ry = 0 is heading to the right: its z axis is the camera's x axis.
  const Eigen::Vector3d ahead = objects.at(0)[1].T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_LT((ahead - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(VdoObjects, EqualStepsAreInterpolated) {
  const ObjectTruths objects = decode_vdo_objects(
      "0 1 0 0 9 9 3.407977 1.5 10 0\n1 1 0 0 9 9 3.388173 1.5 11 0\n2 1 0 0 9 9 3.368369 1.5 12 0\n"
      "3 1 0 0 9 9 3.348566 1.5 13 0\n4 1 0 0 9 9 3.348566 1.5 14.1 0\n6 1 0 0 9 9 3.3 1.5 16 0\n",
      "");
  const std::vector<std::pair<int, bool>> expected = {{0, false}, {1, true},  {2, true},
                                                      {3, false}, {4, false}, {6, false}};
  for (const auto& [frame, interpolated] : expected)
    EXPECT_EQ(objects.at(frame)[0].interpolated, interpolated) << frame;
}

TEST(VdoObjectsErrors, NameFileAndLine) {
  const auto error = [](const char* text, const char* message) {
    expect_error([&] { decode_vdo_objects(text, "object_pose.txt"); }, message);
  };
  error("0 1 0 0 9 9 1 2 3\n",
        "object_pose.txt:1: expected frame id left top right bottom x y z ry (10 values), got 9");
  error("0 1 0 0 9 9 1 2 nan 0\n", "object_pose.txt:1: expected a finite number for z, got 'nan'");
  error("0 0 0 0 9 9 1 2 3 0\n", "object_pose.txt:1: expected an object id of 1 or more");
  error("0 1 0 0 9 9 1 2 3 0\n0 1 0 0 9 9 1 2 3 0\n", "object_pose.txt:2: object 1 appears twice in frame 0");
}

}  // namespace

}  // namespace sextant
