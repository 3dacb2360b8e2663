#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <csignal>
#include <numbers>

#include "sextant/base/quantile.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/kitti_testing.h"
#include "sextant/datasets/kitti_tracking.h"
#include "sextant/datasets/kitti_truth.h"
#include "sextant/datasets/testing.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

constexpr Channels all_channels{
    .gray = true, .rgb = true, .rgb_right = true, .depth = true, .flow = true, .mask = true};

std::string write(const Sequence& sequence, const fs::path& out, const Json& options = Json::object(),
                  const std::string& name = "", int jobs = 2) {
  return find_layout("kitti").write(
      sequence, {.out = out, .sequence = name, .options = options, .jobs = jobs, .quiet = true});
}

// Returns the largest error of poses relative to the first, as in KITTI.
double largest_pose_error(const Sequence& written, const Sequence& read) {
  const int first = written.info().first_frame;
  const SE3 to_first = written.truth().camera.pose(first)->inverse();
  double largest = 0;
  for (int k = read.info().first_frame; k <= read.info().last_frame; ++k) {
    const SE3 expected = to_first * written.truth().camera.pose(first + k).value();
    largest = std::max(largest, (expected.inverse() * read.truth().camera.pose(k).value()).log().norm());
  }
  return largest;
}

void expect_same_measurements(const Frame& a, const Frame& b) {
  EXPECT_EQ(a.rgb, b.rgb);
  EXPECT_EQ(a.rgb_right, b.rgb_right);
  EXPECT_EQ(a.mask, b.mask);
  ASSERT_EQ(a.depth_m.size(), b.depth_m.size());
  for (size_t i = 0; i < a.depth_m.size(); ++i) {
    const float z = a.depth_m.data()[i];
    const bool representable = z > 1.0f / 512 && z < 255.99f;
    ASSERT_EQ(std::isfinite(b.depth_m.data()[i]), representable) << i;
    if (!representable) continue;
    ASSERT_NEAR(b.depth_m.data()[i], z, 1.0 / 512 + 1e-4) << i;
  }
  ASSERT_EQ(a.flow.size(), b.flow.size());
  for (size_t i = 0; i < a.flow.size(); ++i) {
    const Flow f = a.flow.data()[i];
    const Flow g = b.flow.data()[i];
    const bool representable = f.valid() && std::abs(f.u) < 511.9f && std::abs(f.v) < 511.9f;
    if (!representable) {
      ASSERT_FALSE(g.valid() && !f.valid()) << i;
      continue;
    }
    ASSERT_NEAR(g.u, f.u, 0.5 / 64 + 1e-4) << i;
    ASSERT_NEAR(g.v, f.v, 0.5 / 64 + 1e-4) << i;
  }
}

TEST(KittiLayout, EverythingComesBack) {
  TempFolder temp;
  const PatternSequence written(5, 3);
  const std::string source = write(written, temp.path() / "root");
  EXPECT_EQ(source, "kitti:" + (temp.path() / "root").string() + "#0007");
  const auto read = open_with(source);
  const SequenceInfo& info = read->info();
  EXPECT_EQ(info.first_frame, 0);
  EXPECT_EQ(info.last_frame, 4);
  EXPECT_EQ(info.camera.left.fy, 121);
  EXPECT_EQ(info.camera.bf, 60);
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  read->check_files();
  for (int k = 0; k < 5; ++k) {
    expect_same_measurements(written.read(3 + k, all_channels), read->read(k, all_channels));
    ASSERT_EQ(read->truth().objects.at(k).size(), 2u);
    for (const ObjectTruth& object : written.truth().objects.at(3 + k)) {
      const ObjectTruth* other = read->truth().find(k, object.id);
      ASSERT_NE(other, nullptr);
      EXPECT_THAT(other->T_camera_object, SE3Near(object.T_camera_object, 1e-12));
      EXPECT_EQ(other->type, object.type);
      EXPECT_THAT(*other->size_m, EigenNear(*object.size_m, 1e-6));
      EXPECT_NEAR(other->box->left, object.box->left, 1e-6);
      EXPECT_NEAR(other->box->bottom, object.box->bottom, 1e-6);
    }
  }
}

TEST(KittiLayout, PosesComeBackByBothConventions) {
  TempFolder temp;
  const PatternSequence written(40);
  const std::string source = write(written, temp.path());
  for (const char* convention : {"rectified", "authors"}) {
    EXPECT_LT(largest_pose_error(written, *open_with(source, {{"ground_truth", convention}})), 1e-7);
  }
}

TEST(KittiLayout, AnglesAreWrapped) {
  TempFolder temp;
  write(PatternSequence(30), temp.path());
  const fs::path path = temp.path() / "training/label_02/0007.txt";
  double smallest_rad = 0, largest_rad = 0;
  for (const KittiLabel& label : decode_kitti_labels(read_file(path), path.string())) {
    smallest_rad = std::min({smallest_rad, label.rotation_y_rad, label.alpha_rad});
    largest_rad = std::max({largest_rad, label.rotation_y_rad, label.alpha_rad});
    const double bearing_rad = std::atan2(label.position_m.x(), label.position_m.z());
    EXPECT_NEAR(std::cos(label.rotation_y_rad - label.alpha_rad - bearing_rad), 1, 1e-9);
  }
  EXPECT_GT(largest_rad, 2);
  EXPECT_LE(largest_rad, std::numbers::pi + 1e-6);
  EXPECT_LT(smallest_rad, -2);
  EXPECT_GE(smallest_rad, -std::numbers::pi - 1e-6);
}

TEST(KittiLayout, ClassesAreInTheMasks) {
  TempFolder temp;
  write(PatternSequence(2), temp.path());
  const std::string mots = read_file(temp.path() / "training/instances_txt/0007.txt");
  EXPECT_THAT(mots, StartsWith("0 1000 1 48 160 "));
  EXPECT_THAT(mots, HasSubstr("\n0 2003 2 48 160 "));
}

// Labels contain no roll and pitch; object_pose does. Without it the tilt is lost, and nothing else.
TEST(KittiLayout, TiltOfObjectsIsInTheCompanionOfTheLabels) {
  TempFolder temp;
  PatternSequence written(3);
  const double tilt_rad = 0.01;
  for (auto& [frame, objects] : written.truth_.objects) {
    for (ObjectTruth& object : objects) {
      object.T_camera_object = SE3(so3_exp({tilt_rad, 0, 0}) * object.T_camera_object.rotation(),
                                   object.T_camera_object.translation());
    }
  }
  const std::string source = write(written, temp.path());
  const auto with = open_with(source);
  EXPECT_THAT(with->info().provenance, Contains(HasSubstr("6 poses of object_pose")));
  fs::remove(temp.path() / "training/object_pose/0007.txt");
  const auto without = open_with(source);
  EXPECT_THAT(without->info().provenance, Not(Contains(HasSubstr("object_pose"))));
  for (const auto& [frame, objects] : written.truth().objects) {
    for (const ObjectTruth& object : objects) {
      EXPECT_THAT(with->truth().find(frame, object.id)->T_camera_object,
                  SE3Near(object.T_camera_object, 1e-12));
      const SE3 error =
          object.T_camera_object.inverse() * without->truth().find(frame, object.id)->T_camera_object;
      EXPECT_LT(error.translation().norm(), 1e-12);
      EXPECT_NEAR(rotation_angle_rad(error.rotation()), tilt_rad, 1e-4);
    }
  }
}

TEST(KittiLayoutErrors, ObjectPosesBelongToLabels) {
  TempFolder temp;
  const std::string source = write(PatternSequence(3), temp.path());
  const fs::path path = temp.path() / "training/object_pose/0007.txt";
  const std::string good = read_file(path);
  const auto error = [&](const std::string& row, const std::string& message) {
    write_file(path, good + row);
    expect_error([&] { open_with(source); }, path.string() + message);
  };
  const std::string pose = " 1 0 0 5  0 1 0 1  0 0 1 9";
  error("1 8" + pose + "\n", ": track 8 has a pose in frame 1, but no row in ");
  error("1 0" + pose + "\n", ":10: track 0 has a pose in frame 1 already");
  error("1 8 1 0 0\n",
        ":10: expected frame, track id and the 12 or 16 values of T_camera_object, got 5 values");
  error("-1 8" + pose + "\n", ":10: expected a frame number >= 0, got -1");
  error("1 8 1 0 0 5  0 2 0 1  0 0 1 9\n", ":10: expected a rotation in the pose");
  error("1 8 1 0 0 nan  0 1 0 1  0 0 1 9\n", ":10: expected a finite number");
  write_file(path, "# 16 values\r\n0 0" + pose + " 0 0 0 1\r\n");
  EXPECT_NEAR(open_with(source)->truth().find(0, 1)->T_camera_object.translation().z(), 9, 1e-12);
  EXPECT_NEAR(open_with(source)->truth().find(1, 1)->T_camera_object.translation().z(), 12.11, 1e-9);
}

TEST(KittiLayout, WritesTruthWithoutImages) {
  TempFolder temp;
  const PatternSequence written(6, 0, false);
  const auto read = open_with(write(written, temp.path()));
  EXPECT_FALSE(fs::exists(temp.path() / "training/image_02"));
  EXPECT_EQ(read->info().last_frame, 5);
  EXPECT_FALSE(read->info().channels.gray || read->info().channels.depth || read->info().channels.mask);
  EXPECT_LT(largest_pose_error(written, *read), 1e-7);
}

TEST(KittiLayout, FilesDoNotDependOnThreads) {
  TempFolder temp;
  const PatternSequence written(4);
  const auto bytes = [&](const char* name, int jobs) {
    write(written, temp.path() / name, {{"oxts_jitter_ms", 5.0}}, "0000", jobs);
    return files_below(temp.path() / name);
  };
  const auto one = bytes("one", 1);
  EXPECT_EQ(one.size(), 5u + 4 * 5 - 1);  // text files; images, of which the last frame has no flow
  EXPECT_EQ(one, bytes("three", 3));
}

// ---- time jitter of the GPS/IMU samples

std::vector<SE3> straight_drive(int n, double step_m) {
  std::vector<SE3> poses;
  for (int k = 0; k < n; ++k) poses.push_back(SE3(Eigen::Quaterniond::Identity(), {0, 0, step_m * k}));
  return poses;
}

TEST(KittiOxtsTrack, SpeedsAreThoseOfTheUnit) {
  const SE3 T_camera_imu = SE3::from_matrix(
      (Eigen::Matrix<double, 3, 4>() << 0, -1, 0, 0.1, 0, 0, -1, 0.2, 1, 0, 0, -1).finished());
  for (const KittiOxts& sample : oxts_of_track(straight_drive(5, 1.5), 10, T_camera_imu)) {
    EXPECT_THAT(sample.velocity_mps, EigenNear(Eigen::Vector3d(15, 0, 0), 1e-9));
    EXPECT_NEAR(std::hypot(sample.east_mps, sample.north_mps), 15, 1e-9);
    EXPECT_NEAR(sample.roll_rad, 0, 1e-12);
  }
  EXPECT_TRUE(oxts_of_track({}, 10, T_camera_imu).empty());
  EXPECT_EQ(oxts_of_track({SE3()}, 10, T_camera_imu, {.sigma_s = 0.01})[0].velocity_mps.norm(), 0);
}

// As in KITTI, vf and vl are parallel to the ground whatever the tilt of the unit.
TEST(KittiOxtsTrack, SpeedsAreNotTiltedWithTheUnit) {
  const SE3 T_camera_imu = SE3::from_matrix(
      (Eigen::Matrix<double, 3, 4>() << 0, -1, 0, 0.1, 0, 0, -1, 0.2, 1, 0, 0, -1).finished());
  const SE3 tilt(so3_exp({0.1, 0, 0.2}), Eigen::Vector3d::Zero());
  for (const KittiOxts& sample : oxts_of_track(straight_drive(5, 1.5), 10, T_camera_imu * tilt)) {
    EXPECT_GT(std::abs(sample.roll_rad), 0.05);
    EXPECT_NEAR(std::hypot(sample.velocity_mps.x(), sample.velocity_mps.y()), 15, 1e-9);
    EXPECT_NEAR(sample.velocity_mps.z(), 0, 1e-9);
    EXPECT_THAT(sample.map_velocity_mps(), EigenNear(Eigen::Vector3d(15, 0, 0), 1e-9));
  }
}

// A spline through samples of a cubic differs from the cubic at its ends, but is close to it inside.
TEST(KittiOxtsTrack, SpeedsFollowAcceleration) {
  std::vector<SE3> poses;
  const auto position = [](double t) { return 1.2 * t + 0.3 * std::sin(0.7 * t); };  // t in frames
  for (int k = 0; k < 30; ++k) poses.push_back(SE3(Eigen::Quaterniond::Identity(), {0, 0, position(k)}));
  const std::vector<KittiOxts> track = oxts_of_track(poses, 10, SE3());
  for (int k = 3; k < 27; ++k) {
    EXPECT_NEAR(track[k].velocity_mps.norm(), 10 * (1.2 + 0.21 * std::cos(0.7 * k)), 0.02) << k;
  }
}

TEST(KittiOxtsTrack, JitterGivesItsFloor) {
  TempFolder temp;
  const PatternSequence written(1500, 0, false);
  const auto floor_m = [&](const char* name, const Json& options) {
    InputLog inputs;
    write(written, temp.path() / name, options);
    return read_kitti_truth(temp.path() / name, "0007", {}, inputs).truth.camera_step_floor_m.value();
  };
  EXPECT_LT(floor_m("still", Json::object()), 0.001);
  // Step k is v (1 / rate + jitter_k+1 - jitter_k), with a standard deviation of sqrt(2) 5 ms x 10 m/s.
  const double with_5_ms = floor_m("five", {{"oxts_jitter_ms", 5.0}});
  EXPECT_NEAR(with_5_ms, std::sqrt(2) * 0.005 * 10, 0.004);
  EXPECT_NEAR(floor_m("ten", {{"oxts_jitter_ms", 10.0}}), 2 * with_5_ms, 0.004);
  EXPECT_NE(floor_m("other", {{"oxts_jitter_ms", 5.0}, {"seed", 2}}), with_5_ms);
}

TEST(KittiOxtsTrack, CorrectedStepsLoseTheJitter) {
  TempFolder temp;
  const PatternSequence written(300, 0, false);
  write(written, temp.path(), {{"oxts_jitter_ms", 10.0}});
  const auto rms_m = [&](KittiVelocity velocity) {
    InputLog inputs;
    const KittiTruth read = read_kitti_truth(temp.path(), "0007", {.velocity = velocity}, inputs);
    EXPECT_EQ(read.truth.camera_step_floor_m.has_value(), velocity == KittiVelocity::raw);
    double sum = 0;
    for (int k = 0; k + 1 < 300; ++k) {
      const auto length_m = [k](const Trajectory& t) { return t.motion(k, k + 1)->translation().norm(); };
      sum += std::pow(length_m(read.truth.camera) - length_m(written.truth().camera), 2);
    }
    return std::sqrt(sum / 299);
  };
  EXPECT_NEAR(rms_m(KittiVelocity::raw), std::sqrt(2) * 0.010 * 10, 0.02);
  EXPECT_LT(rms_m(KittiVelocity::velocity_corrected), 0.01);
  EXPECT_LT(rms_m(KittiVelocity::velocity_vector), 0.01);
}

TEST(KittiOxtsTrack, ADrawBelongsToItsFrame) {
  const auto track = [](int n) { return oxts_of_track(straight_drive(n, 1), 10, SE3(), {0.005, 3}); };
  const std::vector<KittiOxts> ten = track(10);
  const std::vector<KittiOxts> twenty = track(20);
  for (size_t k = 0; k < 10; ++k) EXPECT_NEAR(ten[k].longitude_deg, twenty[k].longitude_deg, 1e-12);
  double delay_frames = 0;
  for (size_t k = 1; k < 10; ++k) {
    delay_frames = std::max(delay_frames, std::abs((ten[k].longitude_deg - ten[k - 1].longitude_deg) /
                                                       (ten[9].longitude_deg - ten[0].longitude_deg) * 9 -
                                                   1));
  }
  EXPECT_GT(delay_frames, 0.01);
}

// ---- a rendered scene, through files

TEST(KittiLayout, SyntheticSceneComesBack) {
  TempFolder temp;
  const auto scene = open_with("synthetic:s18@0-3");
  const auto read = open_with(write(*scene, temp.path()));
  EXPECT_EQ(read->info().sequence, "0018");
  EXPECT_EQ(read->info().last_frame, 3);
  EXPECT_LT(largest_pose_error(*scene, *read), 1e-6);
  for (int k = 0; k <= 3; ++k) {
    if (k % 3 == 0) expect_same_measurements(scene->read(k, all_channels), read->read(k, all_channels));
    for (const ObjectTruth& object : scene->truth().objects.at(k)) {
      const ObjectTruth* other = read->truth().find(k, object.id);
      ASSERT_NE(other, nullptr) << k << ' ' << object.id;
      EXPECT_THAT(other->T_camera_object, SE3Near(object.T_camera_object, 1e-6));  // the camera nods
    }
  }
}

// Left and right images are consistent: depth computed from them equals that of the scene.
TEST(KittiLayout, StereoMatchesTheDepth) {
  TempFolder temp;
  const auto scene = open_with("synthetic:s18@2-3");
  const auto read = open_with(write(*scene, temp.path()), {{"depth", "sgbm"}});
  const Image<float> truth = scene->read(2, {.depth = true}).depth_m;
  const Image<float> measured = read->read(0, {.depth = true}).depth_m;
  std::vector<double> errors_px;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!std::isfinite(truth.data()[i]) || !std::isfinite(measured.data()[i])) continue;
    errors_px.push_back(
        std::abs(read->info().camera.bf / measured.data()[i] - read->info().camera.bf / truth.data()[i]));
  }
  ASSERT_GT(errors_px.size(), 0.7 * static_cast<double>(truth.size()));
  EXPECT_LT(upper_median(errors_px), 0.3);
}

// ---- content that the format cannot represent

TEST(KittiLayoutErrors, NameTheFrameAndObject) {
  TempFolder temp;
  const auto error = [&](const std::function<void(PatternSequence&)>& spoil, const std::string& message) {
    PatternSequence sequence(3);
    spoil(sequence);
    expect_error([&] { write(sequence, temp.path() / "bad"); }, message);
    EXPECT_FALSE(fs::exists(temp.path() / "bad"));
  };
  error([](PatternSequence& s) { s.truth_.objects.at(1)[0].size_m.reset(); },
        "pattern sequence p7: frame 1: object 1 has no size, which a KITTI label needs");
  error([](PatternSequence& s) { s.truth_.objects.at(1)[1].box.reset(); }, "object 4 has no 2-D box");
  error([](PatternSequence& s) { s.truth_.objects.at(1)[1].id = 1001; },
        "object id 1001: expected an id from 1 to 1000");
  error([](PatternSequence& s) { s.truth_.objects.at(2)[1].type = "Big car"; },
        "object 4 is of type 'Big car': expected a single word, as in KITTI labels");
  error([](PatternSequence& s) { s.info_.rate_hz = 25; }, "25 Hz, but the KITTI layout cannot store a rate");
  error(
      [](PatternSequence& s) {
        Trajectory without;
        without.set(0, SE3());
        s.truth_.camera = without;
      },
      "frame 1 has no true camera pose");
}

// A writer can end at any point: full disk, Ctrl-C.
TEST(KittiLayoutErrors, AnInterruptedWriterLeavesNoFiles) {
  for (const char* layout : {"kitti", "vkitti2"}) {
    TempFolder temp;
    const PatternSequence sequence(4);
    int calls = 0;
    LayoutRequest request{.out = temp.path() / "a" / "b", .quiet = true};
    request.between_frames = [&] {
      if (++calls == 3) throw std::runtime_error("enough");
    };
    EXPECT_THROW(find_layout(layout).write(sequence, request), std::runtime_error);
    EXPECT_EQ(calls, 3);
    EXPECT_FALSE(fs::exists(temp.path() / "a")) << layout;
    request.between_frames = nullptr;
    open_with(find_layout(layout).write(sequence, request))->check_files();
    const auto is_stage = [](const auto& entry) { return entry.path().filename().string().starts_with('.'); };
    EXPECT_TRUE(std::ranges::none_of(fs::directory_iterator(request.out), is_stage)) << layout;
  }
}

// kill -9 runs no destructor.
TEST(KittiLayoutErrors, TheNextWriterRemovesFilesOfAKilledOne) {
  TempFolder temp;
  const PatternSequence sequence(4);
  LayoutRequest request{.out = temp.path(), .quiet = true};
  const auto stages = [&] {
    return std::ranges::count_if(fs::directory_iterator(temp.path()), [](const auto& entry) {
      return entry.path().filename().string().starts_with(".sextant_incomplete_");
    });
  };
  ASSERT_TRUE(WIFSIGNALED(status_of_child([&] {
    request.between_frames = [calls = 0]() mutable {
      if (++calls == 3) ::raise(SIGKILL);
    };
    find_layout("kitti").write(sequence, request);
    return 0;
  })));
  ASSERT_EQ(stages(), 1);
  request.between_frames = [&] {
    if (stages() != 1) throw std::runtime_error("a stage is left");  // one belongs to this writer
  };
  find_layout("kitti").write(sequence, request);
  EXPECT_EQ(stages(), 0);
}

// A folder in the place of the last file ends the move half-way, as kill -9 would.
TEST(KittiLayoutErrors, TheNextWriterCompletesAnInterruptedMove) {
  TempFolder temp;
  const PatternSequence sequence(4);
  const fs::path in_the_way = temp.path() / "a/training/object_pose/0007.txt";
  const auto cut_off = [&] {
    LayoutRequest request{.out = temp.path() / "a", .quiet = true};
    request.between_frames = [&] { fs::create_directories(in_the_way / "x"); };
    expect_error([&] { find_layout("kitti").write(sequence, request); },
                 "0007.txt: cannot create: Is a "
                 "directory");
    EXPECT_TRUE(fs::exists(temp.path() / "a/training/image_02/0007/000003.png"));
    fs::remove_all(in_the_way);
  };
  const auto files = [&](const char* root) { return files_below(temp.path() / root); };
  write(sequence, temp.path() / "whole");
  cut_off();
  EXPECT_EQ(write(sequence, temp.path() / "a"), "kitti:" + (temp.path() / "a").string() + "#0007");
  EXPECT_EQ(files("a"), files("whole"));
  expect_error([&] { write(sequence, temp.path() / "a"); }, "exists already");

  fs::remove_all(temp.path() / "a");
  cut_off();
  write(sequence, temp.path() / "a", Json::object(), "0008");  // another request: both exist then
  write(sequence, temp.path() / "whole", Json::object(), "0008");
  EXPECT_EQ(files("a"), files("whole"));
}

TEST(KittiLayoutErrors, AnEmptyFolderNameIsAnError) {
  for (const Layout& layout : layouts())
    expect_error([&] { layout.write(PatternSequence(2), {.out = "", .quiet = true}); }, "--out");
}

TEST(KittiLayoutErrors, NothingIsOverwritten) {
  TempFolder temp;
  const PatternSequence sequence(2);
  write(sequence, temp.path());
  expect_error([&] { write(sequence, temp.path()); },
               (temp.path() / "training/image_02/0007").string() + ": exists already");
  write(sequence, temp.path(), Json::object(), "0008");
  expect_error([&] { write(sequence, temp.path(), Json::object(), "a/b"); }, "sequence name 'a/b'");
  expect_error(
      [&] {
        write(sequence, temp.path(), {{"oxts_jitter_ms", -1.0}});
      },
      "option layout.oxts_jitter_ms = -1");
  expect_error([&] { write(sequence, temp.path(), {{"oxts_jitter", 1.0}}); }, "unknown option key");
}

}  // namespace

}  // namespace sextant
