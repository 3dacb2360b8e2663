#include <numbers>
#include <random>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

// ---- calibration

KittiCalibration example_calibration() {
  KittiCalibration c;
  for (size_t i = 0; i < 4; ++i) {
    c.P.at(i) << 720, 0, 610, 10.0 - 100.0 * static_cast<double>(i), 0, 721, 173, 0.25, 0, 0, 1, 0.003;
  }
  c.R_rect = so3_exp({0.01, -0.02, 0.005}).toRotationMatrix();
  c.Tr_velo_to_cam.topRows<3>() = SE3::exp({0.1, 0.2, 0.3, 1.2, -1.2, 1.2}).matrix().topRows<3>();
  c.Tr_imu_to_velo = SE3::exp({-0.8, 0.3, -0.8, 0.01, 0.02, 0.03}).matrix().topRows<3>();
  return c;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(KittiCalibration, BothDialectsReadBackExactly) {
  const KittiCalibration c = example_calibration();
  for (const bool object_dialect : {false, true}) {
    const KittiCalibration back =
        decode_kitti_calibration(encode_kitti_calibration(c, object_dialect), "calib.txt");
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(back.P.at(i), c.P.at(i));
    EXPECT_EQ(back.R_rect, c.R_rect);
    EXPECT_EQ(back.Tr_velo_to_cam, c.Tr_velo_to_cam);
    EXPECT_EQ(back.Tr_imu_to_velo, c.Tr_imu_to_velo);
  }
}

TEST(KittiCalibration, OffsetAndBaseline) {
  const KittiCalibration c = example_calibration();
  EXPECT_EQ(c.colour_bf(), 100);
  EXPECT_EQ(c.grey_bf(), 100);
  // K (p + offset) = P (p; 1)
  const Eigen::Vector3d p(1, 2, 10);
  const Eigen::Vector3d q = c.P[2] * p.homogeneous();
  EXPECT_THAT(c.camera(2).project(p + c.offset_m(2)),
              EigenNear(Eigen::Vector2d(q.x() / q.z(), q.y() / q.z()), 1e-12));
}

TEST(KittiCalibrationErrors, NameFileLineKeyAndSpellings) {
  const std::string good = encode_kitti_calibration(example_calibration());
  const auto error = [](const std::string& text, const std::string& message) {
    expect_error([&] { decode_kitti_calibration(text, "c.txt"); }, message);
  };
  const char* spellings =
      "expected P0 P1 P2 P3 and either R_rect Tr_velo_cam "
      "Tr_imu_velo or R0_rect Tr_velo_to_cam Tr_imu_to_velo";
  error(replaced(good, "Tr_velo_cam", "Tr_velo"), "c.txt:6: unknown key 'Tr_velo'");
  error(replaced(good, "Tr_velo_cam", "Tr_velo"), spellings);
  error(good.substr(0, good.find("Tr_imu_velo")), "c.txt: no key Tr_imu_velo (or Tr_imu_to_velo): expected");
  error(replaced(good, good.substr(0, good.find('\n') + 1), ""), "c.txt: no key P0: expected");
  error(replaced(good, "P1: 720", "P1:"), "c.txt:2: P1: expected 12 numbers, got 11");
  error(replaced(good, "P1: 720", "P1: nan"), "c.txt:2: expected a finite number for P1, got 'nan'");
  error(replaced(good, "P1: 720", "P1: -720"), "c.txt:2: P1: expected a rectified projection");
  error(replaced(good, "P1:", "P0:"), "c.txt:2: P0: this key is given in line 1 already");
  error(replaced(good, "R_rect ", "R_rect 2 "), "c.txt:5: R_rect: expected 9 numbers, got 10");
  error(replaced(good, "R_rect 0.99", "R_rect 0.89"), "c.txt:5: R_rect: expected a rotation");
  error(replaced(good, "Tr_velo_cam", "Tr_velo_to_cam"),
        "c.txt:6: Tr_velo_to_cam and, in line 5, R_rect are keys of two different formats");
  error("", "c.txt: no key P0");
  error("calib_time: 09-Jan-2012 13:57:47\n", "c.txt:1: unknown key 'calib_time'");
}

// ---- oxts

KittiOxts example_oxts() {
  KittiOxts s{.latitude_deg = 49.011,
              .longitude_deg = 8.4229,
              .altitude_m = 112.8,
              .roll_rad = 0.02,
              .pitch_rad = -0.01,
              .yaw_rad = -2.1,
              .north_mps = -9,
              .east_mps = -5};
  s.velocity_mps = {10.25, 0.5, -0.125};
  s.rest.back() = 6;
  return s;
}

TEST(KittiOxts, ReadsBackExactly) {
  KittiOxts second = example_oxts();
  second.longitude_deg += 1e-7;
  const std::vector<KittiOxts> back =
      decode_kitti_oxts(encode_kitti_oxts({example_oxts(), second}), "oxts.txt");
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].latitude_deg, 49.011);
  EXPECT_EQ(back[0].yaw_rad, -2.1);
  EXPECT_EQ(back[0].velocity_mps, Eigen::Vector3d(10.25, 0.5, -0.125));
  EXPECT_EQ(back[0].rest.back(), 6);
  EXPECT_EQ(back[1].longitude_deg, 8.4229 + 1e-7);
}

// Agrees with the development kit: at the first sample, a degree of latitude has the length it has on the
// sphere.
TEST(KittiOxts, MercatorIsTrueToScaleAtTheFirstLatitude) {
  const KittiOxts a = example_oxts();
  KittiOxts b = a;
  b.latitude_deg += 1e-4;
  KittiOxts c = a;
  c.longitude_deg += 1e-4;
  const double scale = mercator_scale(a.latitude_deg);
  const double arc_m = 6378137 * 1e-4 * std::numbers::pi / 180;
  const Eigen::Vector3d origin = pose_from_oxts(a, scale).translation();
  EXPECT_THAT(pose_from_oxts(b, scale).translation() - origin, EigenNear(Eigen::Vector3d(0, arc_m, 0), 1e-4));
  EXPECT_THAT(pose_from_oxts(c, scale).translation() - origin,
              EigenNear(Eigen::Vector3d(arc_m * scale, 0, 0), 1e-7));
}

TEST(KittiOxts, YawPitchRollTurnAboutUpLeftAhead) {
  KittiOxts s{.roll_rad = 0.1, .pitch_rad = 0.2, .yaw_rad = 0.3};
  const Eigen::Vector3d ahead = pose_from_oxts(s, 1).rotation() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.3, 1e-12);  // counter-clockwise from east
  EXPECT_NEAR(std::asin(-ahead.z()), 0.2, 1e-12);             // nose down
  const Eigen::Vector3d left = pose_from_oxts(s, 1).rotation() * Eigen::Vector3d::UnitY();
  EXPECT_NEAR(left.z(), std::sin(0.1) * std::cos(0.2), 1e-12);  // right side down
}

TEST(KittiOxts, InverseGivesThePoseBack) {
  std::mt19937_64 generator(3);
  const double scale = mercator_scale(49);
  KittiOxts origin{.latitude_deg = 49, .longitude_deg = 8.4};
  const SE3 base(Eigen::Quaterniond::Identity(), pose_from_oxts(origin, scale).translation());
  for (int i = 0; i < 200; ++i) {
    const SE3 pose = base * SE3::exp(random_twist(generator, 1000, 2));
    EXPECT_THAT(pose_from_oxts(oxts_from_pose(pose, scale), scale), SE3Near(pose, 1e-8));
  }
}

TEST(KittiOxtsErrors, NameFileAndLine) {
  const std::string row = encode_kitti_oxts({example_oxts()});
  const auto error = [](const std::string& text, const char* message) {
    expect_error([&] { decode_kitti_oxts(text, "oxts.txt"); }, message);
  };
  error("", "oxts.txt: no oxts samples in it");
  error(row + "49 8\n",
        "oxts.txt:2: expected 30 values (lat lon alt roll pitch yaw vn ve vf vl vu ...), got 2");
  error(row + "nan" + row.substr(row.find(' ')), "oxts.txt:2: expected a finite number for the latitude");
  error("90" + row.substr(row.find(' ')),
        "oxts.txt:1: expected a latitude between -90 and 90 degrees, got 90");
  error(replaced(row, " 8.4", " 888.4"), "oxts.txt:1: expected a longitude");
  KittiOxts degrees = example_oxts();
  degrees.yaw_rad = -120.3;
  error(encode_kitti_oxts({example_oxts(), degrees}),
        "oxts.txt:2: expected radians between -4 pi and 4 pi for yaw, got '-120.3': convert degrees to "
        "radians");
}

// ---- labels

constexpr const char* car_row = "3 7 Car 0.5 2 -1.5 10.5 20 30 40.25 1.5 1.6 4.2 -2.1 1.7 15.3 -1.57\n";
constexpr const char* dont_care_row = "3 -1 DontCare -1 -1 -10 1 2 3 4 -1000 -1000 -1000 -10 -1 -1 -1\n";

TEST(KittiLabels, ReadsAllColumnsAndWritesThem) {
  const std::vector<KittiLabel> labels =
      decode_kitti_labels(std::string(car_row) + dont_care_row + dont_care_row, "label.txt");
  ASSERT_EQ(labels.size(), 3u);
  const KittiLabel& car = labels[0];
  EXPECT_EQ(car.frame, 3);
  EXPECT_EQ(car.track_id, 7);
  EXPECT_EQ(car.type, "Car");
  EXPECT_EQ(car.truncated, 0.5);
  EXPECT_EQ(car.occluded, 2);
  EXPECT_EQ(car.box, (ImageBox{10.5, 20, 30, 40.25}));
  EXPECT_EQ(car.height_m, 1.5);
  EXPECT_EQ(car.width_m, 1.6);
  EXPECT_EQ(car.length_m, 4.2);
  EXPECT_EQ(car.position_m, Eigen::Vector3d(-2.1, 1.7, 15.3));
  EXPECT_EQ(car.rotation_y_rad, -1.57);
  EXPECT_TRUE(labels[1].dont_care());
  const std::string text = encode_kitti_labels(labels);
  const std::vector<KittiLabel> back = decode_kitti_labels(text, "label.txt");
  ASSERT_EQ(back.size(), 3u);
  EXPECT_EQ(back[0].position_m, car.position_m);
  EXPECT_EQ(encode_kitti_labels(back), text);
}

TEST(KittiLabelsErrors, NameFileAndLine) {
  const auto error = [](const std::string& text, const char* message) {
    expect_error([&] { decode_kitti_labels(text, "label.txt"); }, message);
  };
  const std::string car = car_row;
  error(car + "4 7 Car 0 0 0 1 2 3 4\n", "label.txt:2: expected 17 columns (frame track_id type");
  error(car.substr(0, car.size() - 1) + " 0.9\n", "label.txt:1: expected 17 columns");
  error(replaced(car, "-2.1", "nan"), "label.txt:1: expected a finite number for x, got 'nan'");
  error(replaced(car, "3 7", "3 7.5"), "label.txt:1: expected a whole number for the track id, got '7.5'");
  error(replaced(car, "3 7", "-3 7"), "label.txt:1: expected a frame number >= 0, got -3");
  error(replaced(car, "3 7", "3 -1"), "label.txt:1: expected a track id >= 0 for a Car, got -1");
  error(replaced(car, "4.2", "0"), "label.txt:1: expected height, width and length > 0 for a Car");
  error(car + dont_care_row + car, "label.txt:3: track 7 is in frame 3 twice, line 1 has it already");
}

}  // namespace
}  // namespace sextant
