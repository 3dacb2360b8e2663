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

/// Evaluates with --save-tum, and evaluates each saved pair without an alignment.
class SavedTum : public testing::Test {
 protected:
  /// Writes the poses of these frames of a path; `line_of` formats what stands before and after a pose.
  template <typename Line>
  std::string write(const std::string& name, const std::vector<double>& frames, double error_m,
                    const Line& line_of) {
    std::string text;
    for (const double frame : frames) {
      const double a = 0.1 * frame;
      text += line_of(frame, SE3(Eigen::Quaterniond(Eigen::AngleAxisd(a, Eigen::Vector3d::UnitY())),
                                 {std::sin(a) + error_m * std::cos(7 * frame), -0.3 * a, 2 * a}));
    }
    return folder_.write(name, text);
  }
  std::string tum(const std::string& name, const std::vector<double>& frames, double error_m,
                  double shift_s = 0) {
    return write(name, frames, error_m, [shift_s](double frame, const SE3& T) {
      return fmt::format("{} {}", frame / rate_hz + shift_s, seven(T));
    });
  }
  std::string kitti(const std::string& name, const std::vector<double>& frames, double error_m,
                    bool numbered) {
    return write(name, frames, error_m, [numbered](double frame, const SE3& T) {
      const Eigen::Matrix4d M = T.matrix();
      std::string line = numbered ? fmt::format("{} ", frame) : "";
      for (int i = 0; i < 12; ++i) line += fmt::format("{:.17g}{}", M(i / 4, i % 4), i < 11 ? ' ' : '\n');
      return line;
    });
  }
  static std::vector<double> frames(double first, double last, double step = 1) {
    std::vector<double> out;
    for (double frame = first; frame <= last; frame += step) out.push_back(frame);
    return out;
  }
  void expect_pairs_agree(const std::string& reference, const std::vector<std::string>& estimates,
                          const EgoOptions& options, bool one_reference = true) {
    const EgoScores scores = evaluate_ego_files({.reference = reference, .estimates = estimates}, options);
    const fs::path saved = folder_.path() / "saved";
    write_tum(scores, saved);
    EXPECT_EQ(fs::exists(saved / "reference.tum"), one_reference);
    for (size_t i = 0; i < estimates.size(); ++i) {
      const std::string name = one_reference ? "reference.tum" : fmt::format("reference_{}.tum", i);
      const EgoFiles pair{.reference = saved / name,
                          .estimates = {saved / fmt::format("estimate_{}.tum", i)}};
      const EgoResult again = evaluate_ego_files(pair, {}).runs.front();
      EXPECT_EQ(again.errors.size(), scores.runs[i].errors.size());
      EXPECT_GT(again.statistics.rmse, 1e-3);
      EXPECT_NEAR(again.statistics.rmse, scores.runs[i].statistics.rmse, 1e-12);
    }
  }

  TempFolder folder_;
};

TEST_F(SavedTum, APairHasOneClockAfterAnOffset) {
  EgoOptions options{.alignment = Alignment::se3};
  options.association.offset_s = -0.4;
  expect_pairs_agree(tum("gt.tum", frames(0, 40), 0), {tum("late.tum", frames(0, 40), 0.05, 0.4)}, options);
}

TEST_F(SavedTum, APairHasTheFrameNumbersOfTheReference) {
  std::vector<double> with_gap = frames(0, 12);
  for (const double frame : frames(20, 40)) with_gap.push_back(frame);
  expect_pairs_agree(kitti("gt.txt", frames(0, 40), 0, false), {kitti("gap.txt", with_gap, 0.05, true)}, {});
}

TEST_F(SavedTum, AnInterpolatedReferenceHasTheStampsOfTheEstimate) {
  EgoOptions options{.interpolate_max_gap_s = 1};
  options.association.offset_s = -0.3;
  expect_pairs_agree(tum("gt.tum", frames(0, 40, 4), 0), {tum("dense.tum", frames(0, 40), 0.05, 0.3)},
                     options);
}

TEST_F(SavedTum, PosesThatMatchTheSamePoseHaveStampsOfTheirOwn) {
  EgoOptions options;
  options.association.max_difference_s = 0.11;
  options.association.offset_s = -0.02;
  expect_pairs_agree(tum("gt.tum", frames(0, 100), 0), {tum("twice.tum", frames(10, 20, 0.5), 0.05, 0.02)},
                     options);
}

TEST_F(SavedTum, RunsThatMatchOtherPosesHaveReferencesOfTheirOwn) {
  const std::string gt = tum("gt.tum", frames(0, 40), 0), all = tum("all.tum", frames(0, 40), 0.05);
  expect_pairs_agree(gt, {all, tum("other.tum", frames(0, 40), 0.03)}, {});
  folder_.write("saved/estimate_7.tum", "");  // no file of the command
  expect_pairs_agree(gt, {all, tum("part.tum", frames(5, 30), 0.03)}, {}, false);
  expect_pairs_agree(gt, {all}, {});
  for (const char* name : {"reference_0.tum", "reference_1.tum", "estimate_1.tum"})
    EXPECT_FALSE(fs::exists(folder_.path() / "saved" / name)) << name << " is of an earlier run";
  EXPECT_TRUE(fs::exists(folder_.path() / "saved" / "estimate_7.tum"));
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
