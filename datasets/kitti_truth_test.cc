#include <gmock/gmock.h>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/kitti_oxts.h"
#include "sextant/datasets/kitti_truth.h"
#include "sextant/datasets/vdo_folder.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

using ::testing::HasSubstr;

constexpr double deg = 180 / std::numbers::pi;
constexpr double step_s = 0.1;

// A drive at 10 m/s through gentle bends. The point without lateral slip is `lever_m` behind the unit;
// velocities are delayed by `lag_s`; the attitude has an error of wander_deg at each sample.
std::vector<KittiOxts> drive(int n, double lever_m, double lag_s, const std::vector<double>& wander_deg) {
  const auto yaw = [](double t) { return 0.4 * std::sin(0.8 * t); };
  const auto velocity = [&](double t) {
    const double rate = 0.32 * std::cos(0.8 * t);
    const Eigen::Vector2d ahead(std::cos(yaw(t)), std::sin(yaw(t))), left(-ahead.y(), ahead.x());
    return Eigen::Vector2d(10 * ahead + lever_m * rate * left);
  };
  std::vector<KittiOxts> samples;
  Eigen::Vector3d position(0, 0, 0);
  for (int k = 0; k < n; ++k) {
    const double t = k * step_s;
    const SE3 pose(
        Eigen::Quaterniond(Eigen::AngleAxisd(yaw(t) + wander_deg[k] / deg, Eigen::Vector3d::UnitZ())),
        position);
    KittiOxts sample = oxts_from_pose(pose, 1);
    const Eigen::Vector2d v = velocity(t - lag_s);
    sample.east_mps = v.x();
    sample.north_mps = v.y();
    sample.velocity_mps = {v.norm(), 0, 0};
    sample.rest[8] = 0.32 * std::cos(0.8 * t);  // wz
    samples.push_back(sample);
    for (int i = 0; i < 100; ++i) position.head<2>() += velocity(t + (i + 0.5) * step_s / 100) * step_s / 100;
  }
  return samples;
}

std::vector<double> wander(int n, double size_deg) {
  std::vector<double> out;
  for (int k = 0; k < n; ++k) out.push_back(size_deg * std::sin(2 * std::numbers::pi * k / 300.0));
  return out;
}

TEST(KittiCourse, FindsLeverAndWander) {
  const std::vector<double> planted = wander(600, 1.0);
  const CourseFit fit = kitti_course(drive(600, -0.4, 0.05, planted), step_s, 0.05).value();
  EXPECT_NEAR(fit.lever_m, -0.4, 0.03);
  for (int k = 20; k < 580; ++k) EXPECT_NEAR(fit.slow_rad[k] * deg, -planted[k], 0.1) << k;
  EXPECT_NEAR(fit.highest_deg, 1, 0.1);
  EXPECT_NEAR(fit.lowest_deg, -1, 0.1);
}

TEST(KittiCourse, AnotherLagIsTakenForALever) {
  const std::vector<KittiOxts> samples = drive(600, 0, 0.05, wander(600, 0));
  EXPECT_NEAR(kitti_course(samples, step_s, 0.05)->lever_m, 0, 0.03);
  // lag and lever arm both shift the course in proportion to the turn rate
  EXPECT_NEAR(kitti_course(samples, step_s, 0)->lever_m, -0.05 * 10, 0.05);
}

TEST(KittiCourse, StandingStillHasNone) {
  std::vector<KittiOxts> samples = drive(20, 0, 0, wander(20, 0));
  for (KittiOxts& s : samples) s.east_mps = s.north_mps = 0;
  EXPECT_FALSE(kitti_course(samples, step_s, 0.05).has_value());
}

TEST(KittiCourse, AStopInBetweenIsBridged) {
  const std::vector<double> planted(400, 0.5);
  std::vector<KittiOxts> samples = drive(400, 0, 0, planted);
  for (int k = 100; k < 300; ++k) samples[k].east_mps = samples[k].north_mps = 0;
  const CourseFit fit = kitti_course(samples, step_s, 0).value();
  for (const double slow : fit.slow_rad) EXPECT_NEAR(slow * deg, -0.5, 0.02);
}

TEST(KittiPoseFloor, MeasuresPlantedErrors) {
  const std::vector<KittiOxts> exact = drive(300, -0.4, 0, wander(300, 0));
  const StepFloor steps = kitti_step_floor(exact).value();
  const TruthFloor none = kitti_pose_floor(kitti_imu_poses(exact), exact, steps, -0.4);
  EXPECT_LT(*none.lateral_m, 0.002);
  EXPECT_LT(*none.rotation_timing_deg, 0.01);
  EXPECT_LT(*none.rotation_deg, 0.02);

  // With a constant heading error of 1 deg, steps of 1 m have a lateral component of 17 mm.
  const std::vector<KittiOxts> turned = drive(300, -0.4, 0, std::vector<double>(300, 1));
  EXPECT_NEAR(*kitti_pose_floor(kitti_imu_poses(turned), turned, steps, -0.4).lateral_m, 0.01745, 0.002);

  // Every other sample is 10 ms late: a step of 0.1 s has a relative error of a tenth, and so has its
  // rotation.
  std::vector<KittiOxts> late = exact;
  std::vector<SE3> poses = kitti_imu_poses(exact);
  for (size_t k = 1; k + 1 < poses.size(); k += 2) {
    const SE3 moved(so3_exp(0.1 * so3_log(poses[k + 1].rotation() * poses[k].rotation().conjugate())) *
                        poses[k].rotation(),
                    poses[k].translation() + 0.1 * (poses[k + 1].translation() - poses[k].translation()));
    const KittiOxts at = oxts_from_pose(moved, 1);
    late[k].latitude_deg = at.latitude_deg;
    late[k].longitude_deg = at.longitude_deg;
    late[k].yaw_rad = at.yaw_rad;
  }
  const double rms_turn_deg = 0.32 / std::sqrt(2.0) * step_s * deg;
  const TruthFloor jitter =
      kitti_pose_floor(kitti_imu_poses(late), late, kitti_step_floor(late).value(), -0.4);
  EXPECT_NEAR(*jitter.rotation_timing_deg, 0.1 * rms_turn_deg, 0.02);
  EXPECT_NEAR(*jitter.rotation_deg, 0.1 * rms_turn_deg, 0.02);

  std::vector<KittiOxts> no_rates = exact;
  for (KittiOxts& s : no_rates) s.rest.fill(0);
  EXPECT_FALSE(kitti_pose_floor(kitti_imu_poses(no_rates), no_rates, steps, 0).rotation_deg.has_value());
}

/// A text-only sequence whose camera coincides with the GPS/IMU unit.
class KittiHeadingFiles : public ::testing::Test {
 protected:
  explicit KittiHeadingFiles() {
    write("calib",
          "P0: 700 0 600 0 0 700 180 0 0 0 1 0\nP1: 700 0 600 -350 0 700 180 0 0 0 1 0\n"
          "P2: 700 0 600 0 0 700 180 0 0 0 1 0\nP3: 700 0 600 -350 0 700 180 0 0 0 1 0\n"
          "R_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 1 0 0 0 0 1 0 0 0 0 1 0\nTr_imu_velo 1 0 0 0 0 1 0 0 0 0 1 "
          "0\n");
    write("oxts", encode_kitti_oxts(drive(600, -0.4, 0.05, wander(600, 1.0))));
  }
  void write(const char* folder, const std::string& text) {
    std::filesystem::create_directories(temp_.path() / "training" / folder);
    write_file(temp_.path() / "training" / folder / "0001.txt", text);
  }
  KittiTruth read(const KittiTruthOptions& options) {
    InputLog inputs;
    return read_kitti_truth(temp_.path(), "0001", options, inputs);
  }
  static double turn_deg(const KittiTruth& truth, int k) {
    return so3_log(truth.truth.camera.motion(k, k + 1)->rotation()).z() * deg;
  }
  TempFolder temp_;
};

// The drift of 1 deg over 30 s shifts steps of 1 m by up to 17 mm, and rotates the camera by 0.02 deg per
// frame.
TEST_F(KittiHeadingFiles, CourseOrHeadingTakeTheWanderAway) {
  const KittiTruth yaw = read({.velocity = KittiVelocity::velocity_vector});
  const KittiTruth course =
      read({.velocity = KittiVelocity::velocity_vector, .heading = KittiHeading::course});
  const KittiTruth heading = read({.velocity = KittiVelocity::velocity_heading});
  const double wander_m = 0.0175,
               // amplitudes: of the heading, and of velocities that are delayed in bends
      lag_m = 0.05 * 0.32;
  EXPECT_NEAR(*yaw.floor.lateral_m, std::hypot(wander_m, lag_m) / std::sqrt(2.0), 0.0005);
  EXPECT_LT(*course.floor.lateral_m, 0.002);
  EXPECT_LT(*heading.floor.lateral_m, 0.002);
  EXPECT_THAT(yaw.provenance.at(3), testing::ContainsRegex("lever arm -0\\.(39|40|41) m"));
  const auto rms_deg = [&](const KittiTruth& truth) {
    double squares = 0;
    for (int k = 0; k < 599; ++k) {
      const double t = k * step_s;
      const double turned = 0.4 * (std::sin(0.8 * (t + step_s)) - std::sin(0.8 * t)) * deg;
      squares += std::pow(turn_deg(truth, k) - turned, 2) / 599;
    }
    return std::sqrt(squares);
  };
  EXPECT_NEAR(rms_deg(yaw), 2 * std::numbers::pi / 300 / std::sqrt(2.0), 0.001);
  EXPECT_NEAR(rms_deg(heading), rms_deg(yaw), 1e-9);  // the attitude is unchanged
  EXPECT_LT(rms_deg(course), 0.3 * rms_deg(yaw));
}

TEST_F(KittiHeadingFiles, HeadingAndVelocityAreExclusive) {
  InputLog inputs;
  const KittiTruthOptions both{.velocity = KittiVelocity::velocity_heading, .heading = KittiHeading::course};
  expect_error([&] { both.check(); }, "give one of them");
}

TEST_F(KittiHeadingFiles, VelocitiesThatDisagree) {
  std::vector<KittiOxts> samples = drive(10, 0, 0, wander(10, 0));
  samples[3].velocity_mps.x() = 3;
  write("oxts", encode_kitti_oxts(samples));
  EXPECT_FALSE(read({}).floor.lateral_m.value() < 0);
  expect_error([&] { read({.heading = KittiHeading::course}); }, "heading = course requires them to agree");
}

TEST_F(KittiHeadingFiles, PositionsThatContradictTheSpeedAreNamed) {
  const std::vector<KittiOxts> right = drive(600, -0.4, 0.05, wander(600, 1.0));
  const auto faults = [&](const std::vector<KittiOxts>& samples) {
    write("oxts", encode_kitti_oxts(samples));
    const KittiTruth truth = read({});
    for (const std::string& fault : truth.faults) EXPECT_THAT(truth.warnings, testing::Contains(fault));
    return truth.faults;
  };
  EXPECT_TRUE(faults(right).empty());
  std::vector<KittiOxts> wrong = right;
  wrong.erase(wrong.begin() + 300);
  EXPECT_THAT(faults(wrong),
              testing::ElementsAre(testing::AllOf(
                  HasSubstr("oxts/0001.txt:301: the position moves by 2.0"),
                  HasSubstr(" m from frame 299 to frame 300, but the measured speed times 0.1000 s is 1.00"),
                  HasSubstr("difference of 0.50 m is allowed: is a line missing"))));
  wrong = right;
  wrong[17].altitude_m += 3;
  EXPECT_THAT(faults(wrong),
              testing::ElementsAre(testing::AllOf(HasSubstr("0001.txt:18: the position moves by 3.1"),
                                                  HasSubstr(" allowed; 1 more step is wrong: is a line"))));
  wrong = right;
  wrong[598] = wrong[597];
  EXPECT_THAT(faults(wrong), testing::ElementsAre(HasSubstr("0001.txt:599: the position moves by 0.000 m")));
  // a tenth of the positions is wrong, which does not raise the limit
  wrong = right;
  for (size_t k = 5; k < wrong.size(); k += 20) wrong[k].altitude_m += 3;
  EXPECT_THAT(faults(wrong), testing::ElementsAre(HasSubstr("59 more steps are wrong")));
}

TEST_F(KittiHeadingFiles, PositionsWithoutAFix) {
  std::vector<KittiOxts> samples = drive(20, 0, 0, wander(20, 0));
  for (KittiOxts& s : samples) {
    s.latitude_deg = samples[0].latitude_deg;
    s.longitude_deg = samples[0].longitude_deg;
  }
  write("oxts", encode_kitti_oxts(samples));
  const KittiTruth truth = read({});
  EXPECT_THAT(truth.faults,
              testing::ElementsAre(HasSubstr("oxts/0001.txt: the positions do not change, although the "
                                             "measured speed is up to 10 m/s")));
  EXPECT_FALSE(truth.truth.camera_step_floor_m || truth.floor.lateral_m || truth.floor.rotation_timing_deg);
  EXPECT_THAT(truth.provenance,
              testing::Contains("camera truth floor: unknown, the positions do not change"));
  expect_error([&] { read({.heading = KittiHeading::course}); }, "the positions do not change");
  expect_error([&] { read({.velocity = KittiVelocity::velocity_vector}); }, "the positions do not change");
}

TEST(KittiImuPoses, LongitudesContinueAcross180Degrees) {
  std::vector<KittiOxts> east = drive(20, 0, 0, wander(20, 0)), across = east;
  for (KittiOxts& sample : across)
    sample.longitude_deg += sample.longitude_deg < 5e-5 ? 179.99995 : 179.99995 - 360;
  ASSERT_GT(across.front().longitude_deg, 0);
  ASSERT_LT(across.back().longitude_deg, 0);
  std::vector<KittiOxts> west = across;  // the same drive backwards, from -180 to +180 degrees
  std::ranges::reverse(west);
  const std::vector<SE3> expected = kitti_imu_poses(east), a = kitti_imu_poses(across),
                         b = kitti_imu_poses(west);
  for (size_t k = 1; k < east.size(); ++k) {
    const Eigen::Vector3d way = expected[k].translation() - expected[0].translation();
    EXPECT_THAT(a[k].translation() - a[0].translation(), EigenNear(way, 1e-6)) << k;
    EXPECT_THAT(b[19 - k].translation() - b[19].translation(), EigenNear(way, 1e-6)) << k;
  }
}

// The numbers of the real data set are in docs/datasets.md.
TEST(KittiRealHeading, WandersInSequence03) {
  SEXTANT_NEEDS_DATA("kitti_tracking");
  const auto read = [&](const KittiTruthOptions& options) {
    InputLog inputs;
    return read_kitti_truth(real_data("kitti_tracking"), "0003", options, inputs).floor;
  };
  const TruthFloor yaw = read({.velocity = KittiVelocity::velocity_vector});
  const TruthFloor course =
      read({.velocity = KittiVelocity::velocity_vector, .heading = KittiHeading::course});
  const TruthFloor heading = read({.velocity = KittiVelocity::velocity_heading});
  fmt::print("lateral {:.4f} {:.4f} {:.4f} m; rotation {:.4f} .. {:.4f} deg; by axis {:.4f} {:.4f} {:.4f}\n",
             *yaw.lateral_m, *course.lateral_m, *heading.lateral_m, *yaw.rotation_timing_deg,
             *yaw.rotation_deg, yaw.gyro_deg->x(), yaw.gyro_deg->y(), yaw.gyro_deg->z());
  EXPECT_GT(*yaw.lateral_m, 0.008);
  EXPECT_LT(*course.lateral_m, 0.003);
  EXPECT_LT(*heading.lateral_m, 0.003);
  EXPECT_NEAR(yaw.gyro_deg->z(), 0.0118, 0.0005);
  EXPECT_NEAR(yaw.gyro_deg->y(), 0.0421, 0.0005);
  EXPECT_NEAR(yaw.gyro_deg->x(), 0.0358, 0.0005);
  EXPECT_EQ(*heading.rotation_deg, *yaw.rotation_deg);
}

}  // namespace

namespace {

// A car with sensors that are rotated and translated against each other.
class KittiMadeTruth : public testing::Test {
 protected:
  KittiMadeTruth() {
    KittiCalibration c;
    for (auto& P : c.P) P << 700, 0, 600, 0, 0, 710, 170, 0, 0, 0, 1, 0;
    const Eigen::Vector3d p2 = Eigen::Vector3d(700 * 0.06 + 600 * 0.003, 710 * -0.01 + 170 * 0.003, 0.003);
    c.P[1](0, 3) = -390;
    c.P[2].col(3) = p2;
    c.P[3](0, 3) = p2.x() - 350;
    c.R_rect = rectify_.rotation().toRotationMatrix();
    c.Tr_velo_to_cam = velo_to_cam_.matrix().topRows<3>();
    c.Tr_imu_to_velo = imu_to_velo_.matrix().topRows<3>();
    write("calib", encode_kitti_calibration(c));
    SE3 pose = SE3::exp({650000, 4200000, 100, 0.1, -0.05, 1});
    for (int k = 0; k < 6; ++k) {
      imu_.push_back(pose);
      pose = pose * SE3::exp({1.1 + 0.1 * (k % 2), 0.02, 0.01, 0.01, 0.002, 0.03});
    }
    std::vector<KittiOxts> samples;
    for (const SE3& T : imu_) samples.push_back(oxts_from_pose(T, 0.65));
    // The reader takes its scale from the latitude in the file, so the poses are computed with the reader's
    // scale.
    const double read_scale = mercator_scale(samples[0].latitude_deg);
    for (size_t k = 0; k < imu_.size(); ++k) {
      samples[k].velocity_mps = {11, 0.2, 0.1};
      imu_[k] = pose_from_oxts(samples[k], read_scale);
    }
    write("oxts", encode_kitti_oxts(samples));
    write("label_02", "2 6 Van 0 0 0 10 20 30 40 2 1.9 5 1 1.5 10 0.3\n");
  }
  void write(const char* folder, const std::string& text) {
    fs::create_directories(temp_.path() / "training" / folder);
    write_file(temp_.path() / "training" / folder / "0001.txt", text);
  }
  KittiTruth read(const KittiTruthOptions& options = {}) {
    InputLog inputs;
    return read_kitti_truth(temp_.path(), "0001", options, inputs);
  }

  TempFolder temp_;
  const SE3 rectify_ = SE3::exp({0, 0, 0, 0.01, -0.02, 0.015});
  const SE3 velo_to_cam_ = SE3::exp({0.1, -0.2, -0.3, 1.2, -1.2, 1.2});
  const SE3 imu_to_velo_ = SE3::exp({-0.8, 0.3, -0.8, 0.01, 0.02, -0.01});
  const SE3 offset_{Eigen::Quaterniond::Identity(), {0.06, -0.01, 0.003}};
  std::vector<SE3> imu_;
};

TEST_F(KittiMadeTruth, PosesAreThoseOfTheCamera) {
  const auto expect = [&](KittiPoses convention, const SE3& T_camera_imu) {
    const KittiTruth truth = read({.ground_truth = convention});
    ASSERT_EQ(truth.n_poses, 6);
    for (int k = 0; k < 6; ++k) {
      const SE3 expected = T_camera_imu * imu_[0].inverse() * imu_[k] * T_camera_imu.inverse();
      EXPECT_THAT(truth.truth.camera.pose(k).value(), SE3Near(expected, 1e-8))
          << to_string(convention) << ' ' << k;
    }
  };
  expect(KittiPoses::authors, velo_to_cam_ * imu_to_velo_);
  expect(KittiPoses::rectified, offset_ * rectify_ * velo_to_cam_ * imu_to_velo_);
}

TEST_F(KittiMadeTruth, ObjectsAreInTheCameraOfTheImages) {
  const SE3 labelled(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3 + std::numbers::pi / 2, Eigen::Vector3d::UnitY())),
      {1, 1.5, 10});
  const KittiTruth authors = read({.ground_truth = KittiPoses::authors});
  const KittiTruth rectified = read();
  EXPECT_THAT(authors.truth.find(2, 7)->T_camera_object, SE3Near(labelled, 1e-12));
  EXPECT_THAT(rectified.truth.find(2, 7)->T_camera_object, SE3Near(offset_ * labelled, 1e-12));
  EXPECT_EQ(rectified.truth.find(2, 7)->type, "Van");
  EXPECT_EQ(*rectified.truth.find(2, 7)->size_m, Eigen::Vector3d(1.9, 2, 5));
  EXPECT_EQ(rectified.last_labelled_frame, 2);
}

TEST_F(KittiMadeTruth, BaselineByPresetOrNumber) {
  EXPECT_NEAR(read().camera.bf, 350, 1e-12);
  EXPECT_NEAR(read({.bf_preset = KittiPair::grey}).camera.bf, 390, 1e-12);
  EXPECT_EQ(read({.bf = 123}).camera.bf, 123);
  EXPECT_EQ(read().camera.left.fy, 710);
}

TEST_F(KittiMadeTruth, VelocitiesThatDisagree) {
  EXPECT_NO_THROW(read({.velocity = KittiVelocity::velocity_corrected}));
  expect_error([&] { read({.velocity = KittiVelocity::velocity_vector}); },
               "0001.txt:1: vn, ve are 0 m/s and vf, vl 11 m/s");
}

TEST(KittiStepFloor, StandingStillHasNone) {
  const KittiOxts still;
  EXPECT_FALSE(kitti_step_floor({still, still, still}).has_value());
  EXPECT_FALSE(kitti_step_floor({still}).has_value());
  EXPECT_FALSE(kitti_step_floor({}).has_value());
}

class KittiRealTruth : public testing::Test {
 protected:
  void SetUp() override {
    SEXTANT_NEEDS_DATA("kitti_tracking");
    SEXTANT_NEEDS_DATA("kitti_03_demo");
  }
  KittiTruth read(const std::string& sequence, const KittiTruthOptions& options = {}) {
    return read_kitti_truth(real_data("kitti_tracking"), sequence, options, inputs_);
  }
  std::map<int, SE3> demo_poses() const {
    const fs::path path = real_data("kitti_03_demo/pose_gt.txt");
    return decode_pose_text(read_file(path), path.string());
  }

  InputLog inputs_;
};

double largest_difference(const std::map<int, SE3>& a, const std::map<int, SE3>& b) {
  double largest = 0;
  for (const auto& [frame, pose] : a) {
    largest = std::max(largest, (pose.matrix() - b.at(frame).matrix()).cwiseAbs().maxCoeff());
  }
  return largest;
}

TEST_F(KittiRealTruth, AuthorsAreTheDemosPosesAndRectifiedDiffers) {
  const std::map<int, SE3> demo = demo_poses();
  const KittiTruth authors = read("0003", {.ground_truth = KittiPoses::authors});
  const KittiTruth rectified = read("0003");
  EXPECT_EQ(demo.size(), 144u);
  EXPECT_EQ(authors.n_poses, 144);
  EXPECT_LT(largest_difference(demo, authors.truth.camera.poses()), 1e-6);
  double apart_m = 0;      // distance
  double component_m = 0;  // largest of x, y, z
  for (const auto& [frame, pose] : demo) {
    const Eigen::Vector3d by = rectified.truth.camera.pose(frame).value().translation() - pose.translation();
    apart_m = std::max(apart_m, by.norm());
    component_m = std::max(component_m, by.cwiseAbs().maxCoeff());
  }
  fmt::print("rectified differs by up to {:.4f} m, {:.4f} m along one axis\n", apart_m, component_m);
  EXPECT_NEAR(apart_m, 1.4475, 0.001);
  EXPECT_NEAR(component_m, 1.29, 0.01);
}

TEST_F(KittiRealTruth, ObjectsAreTheDemosObjects) {
  const fs::path path = real_data("kitti_03_demo/object_pose.txt");
  const ObjectTruths demo = decode_vdo_objects(read_file(path), path.string());
  const KittiTruth authors = read("0003", {.ground_truth = KittiPoses::authors});
  const KittiTruth rectified = read("0003");
  int n = 0;
  for (const auto& [frame, objects] : demo) {
    for (const ObjectTruth& object : objects) {
      const ObjectTruth* ours = authors.truth.find(frame, object.id);
      ASSERT_NE(ours, nullptr) << frame << ' ' << object.id;
      EXPECT_THAT(ours->T_camera_object, SE3Near(object.T_camera_object, 1e-5)) << frame << ' ' << object.id;
      EXPECT_EQ(ours->interpolated, object.interpolated) << frame << ' ' << object.id;
      EXPECT_NEAR(ours->box->left, object.box->left, 1e-3);
      EXPECT_EQ(ours->type.empty(), false);
      EXPECT_GT(ours->size_m->minCoeff(), 0.3);
      // Camera 2 is 6 cm to the left of camera 0, so that points lie 6 cm further right in it.
      const ObjectTruth* shifted = rectified.truth.find(frame, object.id);
      const Eigen::Vector3d by = shifted->T_camera_object.translation() - ours->T_camera_object.translation();
      EXPECT_THAT(by, EigenNear(Eigen::Vector3d(0.0598, -0.0004, 0.0027), 1e-4));
      ++n;
    }
  }
  EXPECT_GT(n, 200);
}

TEST_F(KittiRealTruth, FloorIsThatOfTheOxtsJitter) {
  for (const auto& [sequence, floor_m] : {std::pair{"0000", 0.026}, {"0003", 0.056}, {"0005", 0.059}}) {
    const KittiTruth truth = read(sequence);
    ASSERT_TRUE(truth.truth.camera_step_floor_m.has_value());
    EXPECT_NEAR(*truth.truth.camera_step_floor_m, floor_m, 0.002) << sequence;
  }
}

TEST_F(KittiRealTruth, CorrectedStepsHaveTheLengthOfTheSpeed) {
  const fs::path path = real_data("kitti_tracking") / "training" / "oxts" / "0003.txt";
  const std::vector<KittiOxts> samples = decode_kitti_oxts(read_file(path), path.string());
  const StepFloor floor = kitti_step_floor(samples).value();
  EXPECT_NEAR(floor.mean_s, 0.1035, 0.0005);
  const KittiTruth raw = read("0003");
  const KittiTruth corrected = read("0003", {.velocity = KittiVelocity::velocity_corrected});
  EXPECT_FALSE(corrected.truth.camera_step_floor_m.has_value());
  double raw_squares = 0, corrected_squares = 0;
  for (int k = 0; k + 1 < raw.n_poses; ++k) {
    const double speed = (samples[k].velocity_mps.norm() + samples[k + 1].velocity_mps.norm()) / 2;
    const auto off_m = [&](const KittiTruth& truth) {
      return truth.truth.camera.motion(k, k + 1)->translation().norm() - floor.mean_s * speed;
    };
    raw_squares += std::pow(off_m(raw), 2);
    corrected_squares += std::pow(off_m(corrected), 2);
  }
  // The remainder is the lever arm between GPS/IMU unit and camera in bends.
  EXPECT_LT(std::sqrt(corrected_squares / (raw.n_poses - 1)), 0.01);
  EXPECT_GT(std::sqrt(raw_squares / (raw.n_poses - 1)), 0.05);
}

// The receiver corrects positions sideways while the measured velocity stays: by 20 mm per step in sequence
// 03.
TEST_F(KittiRealTruth, VelocityVectorsGiveTheDirectionToo) {
  const fs::path path = real_data("kitti_tracking") / "training" / "oxts" / "0003.txt";
  const std::vector<KittiOxts> samples = decode_kitti_oxts(read_file(path), path.string());
  const StepFloor floor = kitti_step_floor(samples).value();
  EXPECT_NEAR(floor.across_m, 0.0197, 0.0002);
  const KittiTruth corrected = read("0003", {.velocity = KittiVelocity::velocity_corrected});
  const KittiTruth vectors = read("0003", {.velocity = KittiVelocity::velocity_vector});
  double squares = 0;
  for (int k = 0; k + 1 < corrected.n_poses; ++k) {
    const SE3 a = *corrected.truth.camera.motion(k, k + 1), b = *vectors.truth.camera.motion(k, k + 1);
    EXPECT_NEAR(rotation_angle_rad(a.rotation().conjugate() * b.rotation()), 0, 1e-9);
    squares += (a.translation() - b.translation()).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / floor.n_steps), floor.across_m, 0.001);
}

TEST_F(KittiRealTruth, BothCalibrationDialectsAgree) {
  const auto decode = [](const fs::path& path) {
    return decode_kitti_calibration(read_file(path), path.string());
  };
  const KittiCalibration a = decode(real_data("kitti_tracking") / "training" / "calib" / "0005.txt");
  const KittiCalibration b = decode(real_data("kitti_tracking") / "calib_dialect_ciwt" / "0005.txt");
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(a.P.at(i), b.P.at(i));
  EXPECT_EQ(a.R_rect, b.R_rect);
  EXPECT_EQ(a.Tr_velo_to_cam, b.Tr_velo_to_cam);
  EXPECT_EQ(a.Tr_imu_to_velo, b.Tr_imu_to_velo);
  EXPECT_NEAR(a.colour_bf(), 384.3815, 1e-3);
  EXPECT_NEAR(a.grey_bf(), 387.5744, 1e-3);
  EXPECT_EQ(read("0005").camera.bf, a.colour_bf());
  EXPECT_EQ(read("0005", {.bf_preset = KittiPair::grey}).camera.bf, a.grey_bf());
  EXPECT_EQ(read("0005", {.bf = 400}).camera.bf, 400);
}

TEST_F(KittiRealTruth, EverySequenceReads) {
  for (const char* sequence : {"0000", "0001", "0002", "0003", "0004", "0005", "0006", "0018", "0020"}) {
    const KittiTruth truth = read(sequence);
    EXPECT_TRUE(truth.warnings.empty()) << sequence << ": " << truth.warnings.front();
    EXPECT_GT(truth.n_poses, 100) << sequence;
    EXPECT_EQ(truth.last_labelled_frame.value() < truth.n_poses, true) << sequence;
    fmt::print("{}: {} poses, {}\n", sequence, truth.n_poses, truth.provenance.at(2));
  }
}

}  // namespace

}  // namespace sextant
