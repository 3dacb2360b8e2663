#include "sextant/eval/evaluation/trajectory_consistency.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/logs/recordings_testing.h"

namespace sextant {
namespace {

constexpr int n_poses = 2000;

/// Errors of known covariance, written as TUM files together with the covariances.
class Consistency : public testing::Test {
 protected:
  Consistency() {
    std::mt19937 rng(7);
    std::normal_distribution<double> normal;
    for (int i = 0; i < n_poses; ++i) {
      PoseCovariance A;
      for (int k = 0; k < 36; ++k) A(k / 6, k % 6) = normal(rng);
      Vector6d sigma;
      sigma << 0.1, 0.2, 0.15, 0.01, 0.02, 0.015;
      const PoseCovariance P = sigma.asDiagonal() *
                               PoseCovariance(0.2 * A * A.transpose() + PoseCovariance::Identity()) *
                               sigma.asDiagonal();
      Vector6d x;
      for (int k = 0; k < 6; ++k) x[k] = normal(rng);
      const Vector6d e = P.llt().matrixL() * x;
      const double t = 0.05 * i;
      const Eigen::Matrix3d R = so3_exp({0.3 * std::sin(t), t, 0.2 * std::cos(t)}).toRotationMatrix();
      const Eigen::Vector3d p(3 * std::sin(0.3 * t), std::cos(t), 2 * t);
      truth_.add(R, p);
      // e is the correction from the estimate to the truth.
      poses_.add(so3_exp(-e.tail<3>()).toRotationMatrix() * R, p - e.head<3>());
      covariances_.push_back(P);
    }
    for (PoseSeries* s : {&truth_, &poses_}) {
      for (int i = 0; i < n_poses; ++i) s->stamps_s.push_back(0.05 * i);
    }
  }

  using Change = std::function<PoseCovariance(const PoseCovariance&, const Eigen::Matrix3d&)>;
  enum Columns { blocks = 12, triangle = 21, full = 36 };

  std::string written(const Change& change, Columns columns) {
    std::istringstream lines(encode_tum(poses_));
    std::string text, line;
    for (size_t i = 0; std::getline(lines, line); ++i) {
      const PoseCovariance P = change(covariances_[i], poses_.rotations[i]);
      text += line;
      for (int r = 0; r < 6; ++r) {
        for (int c = columns == full ? 0 : r; c < 6; ++c) {
          if (columns != blocks || r / 3 == c / 3) text += fmt::format(" {:.12g}", P(r, c));
        }
      }
      text += "\n";
    }
    return folder_.write("est.tum", text);
  }

  EgoResult evaluate(const Change& change, Columns columns = full, const EgoOptions& options = {}) {
    const EgoFiles files{.reference = folder_.write("gt.tum", encode_tum(truth_)),
                         .estimates = {written(change, columns)}};
    return evaluate_ego_files(files, options).runs.at(0);
  }
  std::string error(const Change& change, Columns columns = full) {
    return error_of([&] { evaluate(change, columns); });
  }

  static PoseCovariance exchanged(const PoseCovariance& P) {
    PoseCovariance Q;
    Q << P.bottomRightCorner<3, 3>(), P.bottomLeftCorner<3, 3>(), P.topRightCorner<3, 3>(),
        P.topLeftCorner<3, 3>();
    return Q;
  }

  TempFolder folder_;
  PoseSeries truth_, poses_;
  std::vector<PoseCovariance> covariances_;
};

TEST_F(Consistency, TrueCovariancesGiveSixAndFourTimesSmallerOnesTwentyFour) {
  const Change as_is = [](const PoseCovariance& P, const auto&) { return P; };
  for (const Columns columns : {triangle, full}) {
    const EgoResult r = evaluate(as_is, columns);
    ASSERT_TRUE(r.consistency);
    EXPECT_NEAR(r.consistency->nees, 6, 0.3);
    EXPECT_NEAR(r.consistency->position_nees, 3, 0.2);
    EXPECT_NEAR(r.consistency->rotation_nees.value(), 3, 0.2);
    EXPECT_TRUE(r.consistency->is_consistent());
  }
  const Change quarter = [](const PoseCovariance& P, const auto&) { return PoseCovariance(P / 4); };
  const EgoResult small = evaluate(quarter);
  EXPECT_NEAR(small.consistency->nees, 24, 1.2);
  EXPECT_FALSE(small.consistency->is_consistent());
  EXPECT_NEAR(
      evaluate([](const PoseCovariance& P, const auto&) { return PoseCovariance(4 * P); }).consistency->nees,
      1.5, 0.1);
}

TEST_F(Consistency, OfARecordingOfOdometry) {
  using namespace recordings;  // NOLINT: its writers
  const auto nees = [&](double times) {
    Channel bag{"/odom", "nav_msgs/Odometry", {}}, mcap{"/odom", "nav_msgs/msg/Odometry", {}};
    for (size_t i = 0; i < poses_.size(); ++i) {
      const Eigen::Quaterniond q(poses_.rotations[i]);
      const Eigen::Vector3d& p = poses_.positions_m[i];
      Sample s{static_cast<uint32_t>(i / 20),
               static_cast<uint32_t>(i % 20) * 50'000'000U,
               {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}};
      for (int k = 0; k < 36; ++k)
        s.covariance[static_cast<size_t>(k)] = times * covariances_[i](k / 6, k % 6);
      bag.messages.push_back(ros1_message(bag.type, s));
      mcap.messages.push_back(cdr_message(mcap.type, s));
    }
    const EgoFiles files{
        .reference = folder_.write("gt.tum", encode_tum(truth_)),
        .estimates = {folder_.write("r.bag", bag_of({bag})), folder_.write("r.mcap", mcap_of({mcap})),
                      folder_.write("r.db3", rosbag2_of({mcap}))}};
    std::vector<double> found;
    for (const EgoResult& run : evaluate_ego_files(files, {}).runs)
      found.push_back(run.consistency.value().nees);
    return found;
  };
  EXPECT_THAT(nees(1), testing::Each(testing::DoubleNear(6, 0.3)));
  EXPECT_THAT(nees(0.25), testing::Each(testing::DoubleNear(24, 1.2)));
}

TEST_F(Consistency, OfPlainFilesOfObjects) {
  const auto nees = [&](LogFormat format, double times, Columns columns, double seen_from_m = 0) {
    const TempFolder logs;
    const std::string rows = read_file(
        written([&](const PoseCovariance& P, const auto&) { return PoseCovariance(times * P); }, columns));
    logs.write("obj_3.tum", rows);
    PoseSeries moved = truth_;
    for (Eigen::Vector3d& p : moved.positions_m) p.x() += seen_from_m;
    logs.write("obj_3_gt.tum", encode_tum(moved));
    const ObjectScores scores =
        evaluate_object_files({.folders = {logs.path().string()}, .format = format, .rate_hz = 20});
    EXPECT_EQ(scores.consistency.size(), 1);
    EXPECT_EQ(scores.consistency.at(0).object, 3);
    return scores.consistency.at(0).nees;
  };
  for (const Columns columns : {triangle, full}) {
    EXPECT_NEAR(nees(LogFormat::poses, 1, columns).nees, 6, 0.3);
    EXPECT_TRUE(nees(LogFormat::poses, 1, columns).is_consistent());
    EXPECT_NEAR(nees(LogFormat::poses, 0.25, columns).nees, 24, 1.2);
  }
  EXPECT_GT(nees(LogFormat::poses, 1, full, 1).nees, 20) << "no alignment hides an offset";

  // Errors of the poses, converted to errors of the motions.
  for (size_t i = 0; i < poses_.size(); ++i) {
    const Eigen::Vector3d e_p = truth_.positions_m[i] - poses_.positions_m[i];
    const Eigen::Matrix3d e_R = truth_.rotations[i] * poses_.rotations[i].transpose();
    truth_.positions_m[i] = {0.1, 0.02, 0.9};
    truth_.rotations[i] = so3_exp({0, 0.01, 0}).toRotationMatrix();
    poses_.positions_m[i] = truth_.positions_m[i] - e_p;
    poses_.rotations[i] = e_R.transpose() * truth_.rotations[i];
  }
  EXPECT_NEAR(nees(LogFormat::motions, 1, full).nees, 6, 0.3);
  EXPECT_NEAR(nees(LogFormat::motions, 0.25, triangle).nees, 24, 1.2);
}

TEST_F(Consistency, AlignmentAndAxesTurnTheCovariancesToo) {
  const Change as_is = [](const PoseCovariance& P, const auto&) { return P; };
  const Eigen::Matrix3d W = so3_exp({0.5, -1, 2}).toRotationMatrix();
  for (size_t i = 0; i < poses_.size(); ++i) {
    poses_.rotations[i] = W * poses_.rotations[i];
    poses_.positions_m[i] = W * poses_.positions_m[i] + Eigen::Vector3d(3, 4, 5);
    poses_.transform_covariance(i, W, 1);
    PoseCovariance J = PoseCovariance::Zero();
    J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = W;
    covariances_[i] = J * covariances_[i] * J.transpose();
  }
  EXPECT_NEAR(evaluate(as_is, full, {.alignment = Alignment::se3}).consistency->nees, 6, 0.3);
}

TEST_F(Consistency, ConventionsOfOpenVinsAndGtsam) {
  const Change openvins = [](const PoseCovariance& P, const Eigen::Matrix3d& R) {
    PoseCovariance J = PoseCovariance::Identity();
    J.bottomRightCorner<3, 3>() = R.transpose();
    return exchanged(J * P * J.transpose());
  };
  const EgoResult of_blocks = evaluate(openvins, blocks);
  EXPECT_NEAR(of_blocks.consistency->position_nees, 3, 0.2) << "what OpenVINS writes: rotation first";
  EXPECT_NEAR(of_blocks.consistency->rotation_nees.value(), 3, 0.2);
  EXPECT_NEAR(evaluate(openvins, full, {.covariance = CovarianceConvention::openvins}).consistency->nees, 6,
              0.3);
  const Change gtsam = [](const PoseCovariance& P, const Eigen::Matrix3d& R) {
    PoseCovariance J = PoseCovariance::Zero();
    J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = R.transpose();
    return exchanged(J * P * J.transpose());
  };
  EXPECT_NEAR(evaluate(gtsam, triangle, {.covariance = CovarianceConvention::gtsam}).consistency->nees, 6,
              0.3);
}

TEST_F(Consistency, BlocksInAnotherOrderAreAnErrorWithTheLine) {
  const Change exchange = [](const PoseCovariance& P, const auto&) { return exchanged(P); };
  const Change cross = [](const PoseCovariance& P, const auto&) {
    PoseCovariance Q = P;
    Q.topRightCorner<3, 3>() = P.topRightCorner<3, 3>().transpose();
    Q.bottomLeftCorner<3, 3>() = P.bottomLeftCorner<3, 3>().transpose();
    return Q;
  };
  const Change one_block = [](const PoseCovariance& P, const auto&) {
    PoseCovariance Q = P;
    Q.topRightCorner<3, 3>() = P.topRightCorner<3, 3>().transpose();
    return Q;
  };
  EXPECT_THAT(error(exchange),
              AllOf(testing::ContainsRegex("est.tum:[0-9]+: "), HasSubstr("rotation seems to stand before")));
  EXPECT_THAT(error(exchange, triangle), HasSubstr("--covariance"));
  EXPECT_THAT(error(cross), testing::ContainsRegex("est.tum:[0-9]+: .*(positive definite|transposed)"));
  EXPECT_THAT(error(one_block), HasSubstr("est.tum:1: the covariance of the pose is not symmetric"));
  EXPECT_THAT(error([](const PoseCovariance& P, const auto&) { return PoseCovariance(-P); }),
              HasSubstr("est.tum:1: the covariance of the pose is not positive definite"));
}

}  // namespace
}  // namespace sextant
