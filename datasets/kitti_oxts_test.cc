#include <gmock/gmock.h>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/kitti_oxts.h"
#include "sextant/datasets/kitti_truth.h"
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
}  // namespace sextant
