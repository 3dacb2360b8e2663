#include "sextant/datasets/kitti_truth.h"

#include <cstdlib>
#include <numbers>

#include "sextant/datasets/codec/kitti_calibration.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/testing.h"
#include "sextant/datasets/vdo_truth.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

class KittiRealTruth : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("SEXTANT_DATA");
    if (data == nullptr) GTEST_SKIP() << "set SEXTANT_DATA to the folder that holds kitti_tracking";
    data_ = data;
    if (!fs::is_directory(root())) GTEST_SKIP() << root() << " is not there";
  }
  fs::path root() const { return data_ / "kitti_tracking"; }
  KittiTruth read(const std::string& sequence, const KittiTruthOptions& options = {}) {
    return read_kitti_truth(root(), sequence, options, inputs_);
  }
  std::map<int, SE3> demo_poses() const {
    const fs::path path = data_ / "kitti_03_demo" / "pose_gt.txt";
    return decode_pose_text(read_file(path), path.string());
  }

  fs::path data_;
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
  const KittiTruth authors = read("0003", {.ground_truth = "authors"});
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
  const fs::path path = data_ / "kitti_03_demo" / "object_pose.txt";
  const ObjectTruths demo = decode_vdo_objects(read_file(path), path.string());
  const KittiTruth authors = read("0003", {.ground_truth = "authors"});
  const KittiTruth rectified = read("0003");
  int n = 0;
  for (const auto& [frame, objects] : demo) {
    for (const ObjectTruth& object : objects) {
      const ObjectTruth* ours = authors.truth.find(frame, object.id);
      ASSERT_NE(ours, nullptr) << frame << ' ' << object.id;
      EXPECT_THAT(ours->T_camera_object, SE3Near(object.T_camera_object, 1e-5)) << frame << ' ' << object.id;
      EXPECT_EQ(ours->interpolated, object.interpolated) << frame << ' ' << object.id;
      EXPECT_NEAR(*ours->left, *object.left, 1e-3);
      EXPECT_EQ(ours->type.empty(), false);
      EXPECT_GT(ours->size_m->minCoeff(), 0.3);
      // Camera 2 sits 6 cm left of camera 0: points lie 6 cm further right in it.
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
  const fs::path path = root() / "training" / "oxts" / "0003.txt";
  const std::vector<KittiOxts> samples = decode_kitti_oxts(read_file(path), path.string());
  const StepFloor floor = kitti_step_floor(samples).value();
  EXPECT_NEAR(floor.mean_s, 0.1035, 0.0005);
  const KittiTruth raw = read("0003");
  const KittiTruth corrected = read("0003", {.velocity = "velocity_corrected"});
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
  // What is left is the lever arm between GPS/IMU unit and camera in bends.
  EXPECT_LT(std::sqrt(corrected_squares / (raw.n_poses - 1)), 0.01);
  EXPECT_GT(std::sqrt(raw_squares / (raw.n_poses - 1)), 0.05);
}

TEST_F(KittiRealTruth, BothCalibrationDialectsAgree) {
  const auto decode = [](const fs::path& path) {
    return decode_kitti_calibration(read_file(path), path.string());
  };
  const KittiCalibration a = decode(root() / "training" / "calib" / "0005.txt");
  const KittiCalibration b = decode(root() / "calib_dialect_ciwt" / "0005.txt");
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(a.P.at(i), b.P.at(i));
  EXPECT_EQ(a.R_rect, b.R_rect);
  EXPECT_EQ(a.Tr_velo_to_cam, b.Tr_velo_to_cam);
  EXPECT_EQ(a.Tr_imu_to_velo, b.Tr_imu_to_velo);
  EXPECT_NEAR(a.colour_bf(), 384.3815, 1e-3);
  EXPECT_NEAR(a.grey_bf(), 387.5744, 1e-3);
  EXPECT_EQ(read("0005").camera.bf, a.colour_bf());
  EXPECT_EQ(read("0005", {.bf_preset = "grey"}).camera.bf, a.grey_bf());
  EXPECT_EQ(read("0005", {.bf = 400}).camera.bf, 400);
}

TEST_F(KittiRealTruth, EverySequenceReads) {
  for (const char* sequence : {"0000", "0001", "0002", "0003", "0004", "0005", "0006", "0018", "0020"}) {
    const KittiTruth truth = read(sequence);
    EXPECT_TRUE(truth.warnings.empty()) << sequence;
    EXPECT_GT(truth.n_poses, 100) << sequence;
    EXPECT_EQ(truth.last_labelled_frame.value() < truth.n_poses, true) << sequence;
    fmt::print("{}: {} poses, floor {:.4f} m\n", sequence, truth.n_poses, *truth.truth.camera_step_floor_m);
  }
}

}  // namespace
}  // namespace sextant
