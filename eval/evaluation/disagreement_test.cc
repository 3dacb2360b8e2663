#include "sextant/eval/evaluation/trajectory_explanation.h"

#include <random>

#include "sextant/eval/evaluation/ego_drive_testing.h"
#include "sextant/eval/evaluation/object_drive_testing.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

/// The drive with the pitch that bumps of the road cause, multiplied by `factor`.
PoseSeries bumpy(double factor) {
  PoseSeries s = drive(400, 10);
  for (size_t i = 0; i < s.size(); ++i) {
    const double pitch = 0.01 * factor * std::sin(0.9 * static_cast<double>(i));
    s.rotations[i] = s.rotations[i] * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX());
  }
  return noisy(s);
}

TEST(Disagreement, OfACameraIsReported) {
  EXPECT_THAT(evaluate(drive(400, 10), noisy(drive(400, 10))).warnings, IsEmpty());
  EXPECT_THAT(evaluate(bumpy(1), bumpy(0.9)).warnings, IsEmpty());
  // Steps chained in the wrong order, E_k P_k-1 in place of P_k-1 E_k.
  const PoseSeries truth = drive(400, 10);
  PoseSeries chained = truth;
  SE3 P = truth.pose(0);
  for (size_t i = 1; i < truth.size(); ++i) {
    P = truth.pose(i - 1).inverse() * truth.pose(i) * P;
    chained.rotations[i] = P.rotation().toRotationMatrix();
    chained.positions_m[i] = P.translation();
  }
  PoseSeries still = truth;
  for (size_t i = 0; i < truth.size(); ++i)
    still.positions_m[i] = 0.01 * Eigen::Vector3d(std::sin(37.0 * i), std::sin(91.0 * i), std::sin(53.0 * i));
  for (const Alignment how : {Alignment::none, Alignment::se3, Alignment::sim3}) {
    EXPECT_THAT(evaluate(truth, chained, {.alignment = how}).warnings, Contains(code("unexplained")));
    EXPECT_THAT(evaluate(truth, still, {.alignment = how}).warnings, Contains(code("unexplained")));
    EXPECT_THAT(evaluate(bumpy(1), bumpy(-1), {.alignment = how}).warnings,
                Contains(text("turns about its axis x -1 +- ")));
  }
}

TEST(Disagreement, RotationsThatAreUnrelatedAreReported) {
  const PoseSeries truth = drive(400, 10);
  PoseSeries as_radians = noisy(truth), random = noisy(truth);
  std::srand(4);
  for (size_t i = 0; i < truth.size(); ++i) {
    const Eigen::AngleAxisd turn(truth.rotations[i]);
    as_radians.rotations[i] = Eigen::AngleAxisd(degrees(turn.angle()), turn.axis()).toRotationMatrix();
    random.rotations[i] = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
  }
  for (const Alignment how : {Alignment::none, Alignment::se3}) {
    EXPECT_THAT(evaluate(truth, as_radians, {.alignment = how}).warnings, Contains(code("large_rotations")));
    EXPECT_THAT(evaluate(truth, random, {.alignment = how}).warnings, Contains(code("large_rotations")));
  }
}

TEST(Disagreement, AConstantCoordinateThatExplainsTheErrorIsNamed) {
  PoseSeries hilly = drive(400, 10), flat;
  for (size_t i = 0; i < hilly.size(); ++i)
    hilly.positions_m[i].y() = 3 * std::sin(0.03 * static_cast<double>(i));
  flat = noisy(hilly);
  for (Eigen::Vector3d& p : flat.positions_m) p.y() = 0;
  for (const Alignment how : {Alignment::none, Alignment::se3, Alignment::sim3}) {
    EXPECT_THAT(evaluate(hilly, flat, {.alignment = how}).warnings,
                ElementsAre(testing::AllOf(code("constant"), text("estimate's y is 0 m in all poses"))));
  }
  PoseSeries planar = noisy(drive(400, 10));  // its reference moves by 0.4 m in y and by 320 m in z
  for (Eigen::Vector3d& p : planar.positions_m) p.y() = 0;
  EXPECT_THAT(evaluate(drive(400, 10), planar, {.alignment = Alignment::se3}).warnings, IsEmpty());
}

TEST(Disagreement, DriftIsNoDisagreement) {
  // Scale and heading drift as those of a monocular odometry: the scale falls to a fifth.
  const PoseSeries truth = drive(2000, 10);
  PoseSeries drifted = truth;
  SE3 P = truth.pose(0);
  for (size_t i = 1; i < truth.size(); ++i) {
    SE3 step = truth.pose(i - 1).inverse() * truth.pose(i);
    const double scale = std::exp(-1.6 * static_cast<double>(i) / 2000);
    P = P * SE3(step.rotation() * about_y(0.001, {0, 0, 0}).rotation(), scale * step.translation());
    drifted.rotations[i] = P.rotation().toRotationMatrix();
    drifted.positions_m[i] = P.translation();
  }
  const EgoResult r = evaluate(truth, drifted, {.alignment = Alignment::sim3});
  EXPECT_GT(r.statistics.rmse, 0.3 * rms_extent_m(truth));
  EXPECT_THAT(r.warnings, IsEmpty());
}

TEST(Disagreement, AStandstillHasNoScale) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const auto standing = [&](double step_m) {
    PoseSeries s = drive(100, 10);
    Eigen::Vector3d drift = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < s.size(); ++i) {
      drift += step_m * Eigen::Vector3d(normal(random), normal(random), normal(random));
      s.rotations[i].setIdentity();
      s.positions_m[i] = drift;
    }
    return s;
  };
  for (int run = 0; run < 5; ++run) {
    const PoseSeries truth = standing(0.002), estimate = standing(0.0005);
    for (const Alignment how : {Alignment::none, Alignment::se3})
      EXPECT_THAT(evaluate(truth, estimate, {.alignment = how}).warnings, IsEmpty());
  }
}

/// The log of a drive whose estimated motions, in the body frame, are changed.
template <typename Change>
ObjectLog log_of(const Drive& drive, const Change& change) {
  ObjectLog log;
  log.estimator = "slam";
  log.true_poses = log.poses = drive.L;
  log.camera = log.true_camera = drive.camera;
  for (const auto& [key, H] : drive.estimate) {
    const SE3& L = drive.L.at(previous(key));
    log.motions[key] = {L * change(body_motion(H, L), key) * L.inverse(), std::nullopt};
  }
  return log;
}

auto diagnosis(const std::string& name) { return testing::Field("code", &DataWarning::code, name); }

TEST(Disagreement, OfObjectsIsReported) {
  const Drive drive;
  const auto same = [](const SE3& B, ObjectFrame) { return B; };
  EXPECT_THAT(diagnose_disagreement(log_of(drive, same)), IsEmpty());
  for (const double factor : {3.0, 0.5, 0.0}) {
    const auto scaled = [&](const SE3& B, ObjectFrame) {
      return SE3(B.rotation(), factor * B.translation());
    };
    EXPECT_THAT(diagnose_disagreement(log_of(drive, scaled)), Contains(diagnosis("translation_factor")))
        << factor;
  }
  const auto large = [](const SE3& B, ObjectFrame key) {
    return key.second % 5 == 0 ? B * about_y(3, {0, 0, 0}) : B;
  };
  EXPECT_THAT(diagnose_disagreement(log_of(drive, large)), ElementsAre(diagnosis("large_rotations")));
}

TEST(Disagreement, HeadingsAgainstATurningCameraAreReported) {
  // A camera that turns, and cars that hardly do.
  Drive drive;
  SE3 C = about_y(0.2, {1, 0, 0});
  for (int k = 0; k < Drive::n_frames; ++k) {
    drive.camera.set(k, C);
    C = C * about_y(0.03, {0, 0, 0.8});
  }
  for (const double times : {1.0, 2.0}) {
    const auto follows_camera = [&](const SE3& B, ObjectFrame) {
      return SE3(B.rotation() * about_y(0.03 * times, {0, 0, 0}).rotation(), B.translation());
    };
    const auto found = diagnose_disagreement(log_of(drive, follows_camera));
    EXPECT_THAT(found, Contains(diagnosis("camera_rotation"))) << times;
  }
  const auto same = [](const SE3& B, ObjectFrame) { return B; };
  EXPECT_THAT(diagnose_disagreement(log_of(drive, same)), Not(Contains(diagnosis("camera_rotation"))));
}

TEST(Disagreement, AxesOfObjectsThatAreTurnedAreNamed) {
  const Drive drive;
  ObjectLog log = log_of(drive, [](const SE3& B, ObjectFrame) { return B; });
  for (auto& [key, pose] : log.poses) pose = pose * about_y(-1.5707963, {0, 0, 0});
  const auto found = diagnose_disagreement(log);
  ASSERT_THAT(found, ElementsAre(diagnosis("object_axes")));
  EXPECT_THAT(found[0].text, testing::HasSubstr("turned by 90 deg"));
  EXPECT_THAT(found[0].text, testing::HasSubstr("by 90 deg about its own axis [0.000 1.000 0.000]"));
}

}  // namespace
}  // namespace sextant
