#include "sextant/eval/evaluation/object_evaluation.h"

#include <random>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/object_drive_testing.h"
#include "sextant/eval/evaluation/recorded_files.h"

namespace sextant {
namespace {

TEST(PlainObjectFiles, AreReadInEveryLayoutAndScoredByTheirRate) {
  const Drive drive;
  for (const bool tum : {false, true}) {
    const TempFolder folder;
    for (const int id : {1, 4}) {
      std::string motions, truth;
      for (int k = 1; k < Drive::n_frames; ++k) {
        const auto text = [&](const SE3& T) {
          const Eigen::Quaterniond& q = T.rotation();
          if (tum)
            return fmt::format("{} {} {} {} {} {} {} {}\n", k / 20.0, T.translation().x(),
                               T.translation().y(), T.translation().z(), q.x(), q.y(), q.z(), q.w());
          std::string line = std::to_string(k);
          for (int i = 0; i < 12; ++i) line += fmt::format(" {}", T.matrix()(i / 4, i % 4));
          return line + "\n";
        };
        motions += text(drive.estimate.at({id, k}));
        truth += text(drive.truth({id, k}));
      }
      folder.write(fmt::format("obj_{}_motion.txt", id), motions);
      folder.write(fmt::format("obj_{}_motion_gt.txt", id), truth);
    }
    ObjectFiles files;
    files.folders = {folder.path()};
    files.format = LogFormat::motions;
    const ObjectScores scores = evaluate_object_files(files);
    EXPECT_TRUE(scores.diagnoses.empty());
    EXPECT_EQ(scores.records.size(), 2u * (Drive::n_frames - 1));
    EXPECT_EQ(scores.rate_text(), tum ? "Frame rate: 20 Hz (time stamps of the log)"
                                      : "Frame rate: 10 Hz (default, --rate changes it)");
    EXPECT_THAT(scores.frame_text(), HasSubstr("world, which nothing in the log can confirm"));
    for (const Record& record : scores.records) EXPECT_EQ(record.status, Status::ok);
  }
}

/// Writes motions of two objects at 10 Hz as TUM rows that begin at `first_s`; object 4 has a single
/// motion, in frame 10, at a whole second.
std::vector<Record> records_of_times(double first_s) {
  const Drive drive;
  const TempFolder folder;
  for (const int id : {1, 4}) {
    for (const bool is_truth : {false, true}) {
      std::string text;
      for (int k = id == 4 ? 10 : 1; k < (id == 4 ? 11 : Drive::n_frames); ++k) {
        const SE3 T = is_truth ? drive.truth({id, k}) : drive.estimate.at({id, k});
        text += fmt::format("{:.6f} {} {}\n", first_s + k / 10.0, fmt::join(T.translation(), " "),
                            fmt::join(T.rotation().coeffs(), " "));
      }
      folder.write(fmt::format("obj_{}_motion{}.txt", id, is_truth ? "_gt" : ""), text);
    }
  }
  ObjectFiles files;
  files.folders = {folder.path()};
  files.format = LogFormat::motions;
  return evaluate_object_files(files).records;
}

TEST(PlainObjectFiles, AWholeSecondIsNoFrameNumber) {
  const std::vector<Record> records = records_of_times(0);
  EXPECT_EQ(records.size(), static_cast<size_t>(Drive::n_frames));
  EXPECT_EQ(records.back().body, "object:4");
  EXPECT_EQ(records.back().frame, 10);
}

TEST(PlainObjectFiles, UnixTimesBeginWithFrame0) {
  const std::vector<Record> records = records_of_times(1.6e9);
  EXPECT_EQ(records.size(), static_cast<size_t>(Drive::n_frames));
  EXPECT_EQ(records.front().frame, 0);
  EXPECT_EQ(records.back().frame, 9);
}

/// Poses of objects with errors of known covariance, written as plain files, must give the expected NEES or
/// an error.
TEST(PlainObjectFiles, CovariancesOfObjectsAreJudgedByTheirNees) {
  constexpr int n_poses = 400;
  const auto evaluate = [&](double times, bool exchanged, std::optional<CovarianceConvention> convention) {
    const TempFolder folder;
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (const int id : {1, 4}) {
      std::string own, truth;
      SE3 pose = about_y(0.3 * id, {2.0 * id, 1, 9});
      for (int k = 0; k < n_poses; ++k) {
        pose = pose * about_y(0.02 * std::cos(0.1 * k), {0, 0, 0.5});
        // openvins: position in the world, rotation in the body.
        const Eigen::Matrix<double, 6, 1> sigma(0.004, 0.002, 0.003, 0.05, 0.02, 0.08);  // rotation, position
        Vector6d e;
        for (int i = 0; i < 6; ++i) e[i] = sigma[i] * normal(random);
        const SE3 estimate(pose.rotation() * so3_exp(e.head<3>()), pose.translation() + e.tail<3>());
        std::string numbers;
        for (int i = 0; i < 6; ++i) {
          for (int j = i; j < 6; ++j) {
            const int at = exchanged ? (i + 3) % 6 : i;
            numbers += fmt::format(" {:.17g}", i == j ? times * sigma[at] * sigma[at] : 0);
          }
        }
        const auto text = [&](const SE3& T) {
          const Eigen::Vector4d& q = T.rotation().coeffs();
          return fmt::format("{} {:.17g} {:.17g}", k, fmt::join(T.translation(), " "), fmt::join(q, " "));
        };
        own += text(estimate) + numbers + "\n";
        truth += text(pose) + "\n";
      }
      folder.write(fmt::format("obj_{}.tum", id), own);
      folder.write(fmt::format("obj_{}_gt.tum", id), truth);
    }
    ObjectFiles files;
    files.folders = {folder.path()};
    files.format = LogFormat::poses;
    files.covariance = convention;
    return evaluate_object_files(files).consistency;
  };
  const double tolerance = 6 * 3 * std::sqrt(2.0 / (6 * n_poses));
  for (const double times : {1.0, 0.25}) {
    const auto found = evaluate(times, false, CovarianceConvention::openvins);
    ASSERT_EQ(found.size(), 2u);
    for (const ObjectConsistency& object : found) {
      EXPECT_NEAR(object.nees.nees, 6 / times, tolerance / times) << object.object;
      EXPECT_EQ(object.nees.n, static_cast<size_t>(n_poses));
    }
  }
  try {
    evaluate(1, true, CovarianceConvention::openvins);
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(std::string(error.what()), AllOf(HasSubstr("obj_1.tum"), HasSubstr("--covariance")));
  }
}

TEST(ObjectPaths, AreAlignedAnObjectAtATime) {
  const Drive drive;
  const SE3 moved = about_y(0.4, {3, 2, 1});
  ObjectLog log;
  log.true_poses = drive.L;
  for (const auto& [key, L] : drive.L) log.poses[key] = (key.first == 1 ? moved : moved.inverse()) * L;
  for (const auto& [key, H] : drive.estimate) log.motions[key].estimate = drive.truth(key);
  const std::vector<ObjectPathErrors> errors = object_path_errors(log);
  ASSERT_EQ(errors.size(), 2u);
  for (const ObjectPathErrors& e : errors) {
    EXPECT_NEAR(e.ape->Et_m, 0, 1e-9);
    EXPECT_NEAR(e.ape->ER_deg, 0, 1e-6);
    EXPECT_NEAR(e.rpe->Et_m, 0, 1e-9);
    EXPECT_NEAR(e.chained_rpe->Et_m, 0, 1e-9);
  }
  // Errors per axis are relative to the first pose, so another origin of the body causes none.
  for (const auto& [key, L] : drive.L) log.poses[key] = L * moved;
  for (const ObjectPathErrors& e : object_path_errors(log)) EXPECT_NEAR(e.axes->largest_m, 0, 1e-9);
}

TEST(ObjectPaths, EqualThoseOfTheSavedFilesAsTrajectories) {
  // evaluate_ego equals evo to 1e-12 (eval/cli/evaluate_ego_oracle.py).
  const Drive drive;
  const TempFolder logs, saved;
  std::map<ObjectFrame, SE3> poses;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const auto& [key, L] : drive.L) {
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = 0.05 * normal(random);
    poses[key] = SE3::exp(xi) * L;
  }
  ObjectFiles files = write_dynosam(drive, poses, logs);
  files.tum = saved.path();
  for (const ObjectPathErrors& errors : evaluate_object_files(files).paths) {
    EgoFiles paths;
    const std::string stem = (saved.path() / "m" / fmt::format("obj_{}", errors.object)).string();
    paths.reference = stem + "_gt.tum";
    paths.estimates = {stem + ".tum"};
    paths.format = "tum";
    EgoOptions options;
    options.alignment = Alignment::se3;
    EXPECT_NEAR(evaluate_ego_files(paths, options).runs[0].statistics.rmse, errors.ape->Et_m, 1e-9);
    options.rpe_lengths = {PairSelection{}};
    EXPECT_NEAR(evaluate_ego_files(paths, options).runs[0].statistics.rmse, errors.rpe->Et_m, 1e-9);
    options.relation = PoseRelation::angle_deg;
    EXPECT_NEAR(evaluate_ego_files(paths, options).runs[0].statistics.rmse, errors.rpe->ER_deg, 1e-9);
  }
}

}  // namespace
}  // namespace sextant
