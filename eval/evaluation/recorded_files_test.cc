#include "sextant/eval/evaluation/recorded_files.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

constexpr int n_recorded = 20;
constexpr double rate_hz = 5;

/// A curved path that climbs.
SE3 camera_pose(int frame) {
  const double a = 0.1 * frame;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(a, Eigen::Vector3d(0.1, 1, 0.2).normalized())),
          Eigen::Vector3d(std::sin(a), -0.3 * a, 2 * a)};
}

std::string seven(const SE3& T) {
  const auto& p = T.translation();
  const auto& q = T.rotation();
  return fmt::format("{} {} {} {} {} {} {}\n", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

/// pose_left.txt in TartanAir's form, in NED axes and without times, and the same poses of the camera with
/// stamps.
class PosesWithoutTime : public testing::Test {
 protected:
  PosesWithoutTime() {
    const SE3 T_opencv_ned(Eigen::Quaterniond(opencv_from_axes(Axes::ned)), Eigen::Vector3d::Zero());
    std::string ned, camera;
    for (int k = 0; k < n_recorded; ++k) {
      ned += seven(T_opencv_ned.inverse() * camera_pose(k) * T_opencv_ned);
      camera += fmt::format("{} {}", k / rate_hz, seven(camera_pose(k)));
    }
    files_.reference = folder_.write("pose_left.txt", ned);
    files_.estimates = {folder_.write("camera.tum", camera)};
    options_.reference_frame.axes = Axes::ned;
  }
  double rmse() { return evaluate_ego_files(files_, options_).runs.front().statistics.rmse; }

  TempFolder folder_;
  EgoFiles files_;
  EgoOptions options_;
};

TEST_F(PosesWithoutTime, TakeTheirTimeFromTheRate) {
  files_.rate_hz = rate_hz;
  const EgoScores scores = evaluate_ego_files(files_, options_);
  EXPECT_EQ(scores.runs.front().reference.size(), n_recorded);
  EXPECT_LT(rmse(), 1e-12);
}

TEST_F(PosesWithoutTime, WithoutARateTheyNeedAnotherWithoutATime) {
  expect_error([&] { rmse(); }, "give --rate");
  files_.estimates = {files_.reference};
  options_.estimate_frame.axes = Axes::ned;
  EXPECT_EQ(rmse(), 0);
}

TEST_F(PosesWithoutTime, ARateThatIsOfNoUseOrNoneIsAnError) {
  files_.rate_hz = 0;
  expect_error([&] { rmse(); }, "--rate 0: must be finite and above 0");
  files_.rate_hz = rate_hz;
  files_.reference = files_.estimates.front();
  options_.reference_frame.axes = Axes::opencv;
  expect_error([&] { rmse(); }, "all of these have some");
}

TEST(PosesWithoutTimeReal, TartanairAgainstItself) {
  SEXTANT_NEEDS_DATA("tartanair2_abs_P000");
  const std::string poses = real_data("tartanair2_abs_P000") / "pose_lcam_front.txt";
  EgoFiles files{.reference = poses, .estimates = {poses}, .rate_hz = 10};
  EgoOptions options;
  options.reference_frame.axes = options.estimate_frame.axes = Axes::ned;
  const EgoScores scores = evaluate_ego_files(files, options);
  EXPECT_EQ(scores.runs.front().reference.size(), 1360U);
  EXPECT_NEAR(scores.runs.front().reference.stamps_s.back(), 135.9, 1e-12);
}

}  // namespace
}  // namespace sextant
