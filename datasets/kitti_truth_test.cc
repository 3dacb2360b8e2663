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
