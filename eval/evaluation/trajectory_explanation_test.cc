#include "sextant/eval/evaluation/trajectory_explanation.h"

#include <cmath>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/evaluation/body_offset.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/geometry/axes.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {
using testing::Field;

auto has_code(const std::string& name) { return Field("code", &DataWarning::code, name); }

/// A flight that rotates about all axes, in right-down-forward axes.
PoseSeries flight(int n) {
  PoseSeries s;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p(0, 0, 0);
  for (int i = 0; i < n; ++i) {
    s.add(R, p);
    s.stamps_s.push_back(100 + 0.1 * i);
    p += R * Eigen::Vector3d(0, 0, 0.5 + 0.2 * std::sin(0.05 * i));
    R = R * so3_exp({0.02 * std::cos(0.11 * i), 0.05 * std::sin(0.031 * i), 0.02 * std::sin(0.07 * i)})
                .toRotationMatrix();
  }
  return s;
}

/// Errors of a few centimetres and tenths of a degree.
PoseSeries with_random_errors(PoseSeries s) {
  std::mt19937_64 generator(1);
  for (size_t i = 0; i < s.size(); ++i) {
    const Vector6d xi = random_twist(generator, 0.02, 0.002);
    s.positions_m[i] += xi.head<3>();
    s.rotations[i] = s.rotations[i] * so3_exp(xi.tail<3>()).toRotationMatrix();
  }
  return s;
}

/// Poses of the body that carries the camera.
PoseSeries body_of(PoseSeries camera, const Eigen::Vector3d& lever) {
  for (size_t i = 0; i < camera.size(); ++i) camera.positions_m[i] -= camera.rotations[i] * lever;
  return camera;
}

PoseSeries in_axes(PoseSeries s, Axes axes) {
  const Eigen::Matrix3d C = opencv_from_axes(axes);
  for (size_t i = 0; i < s.size(); ++i) {
    s.positions_m[i] = C.transpose() * s.positions_m[i];
    s.rotations[i] = C.transpose() * s.rotations[i] * C;
  }
  return s;
}

PoseSeries turned(PoseSeries s, double angle_rad, const Eigen::Vector3d& axis, const Eigen::Vector3d& shift) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
  for (size_t i = 0; i < s.size(); ++i) {
    s.positions_m[i] = R * s.positions_m[i] + shift;
    s.rotations[i] = R * s.rotations[i];
  }
  return s;
}

PoseSeries w_read_last(PoseSeries s) {
  for (Eigen::Matrix3d& R : s.rotations) {
    const Eigen::Quaterniond q(R);  // written w x y z, read x y z w
    R = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  }
  return s;
}

std::vector<DataWarning> warnings(const PoseSeries& reference, const PoseSeries& estimate,
                                  Alignment alignment = Alignment::none) {
  return warnings_of_explanations({reference, estimate}, {alignment, 0, Eigen::Vector3d::Zero()}, {});
}

TEST(Explanation, AGoodEstimateNeedsNone) {
  for (const Alignment how : {Alignment::none, Alignment::origin, Alignment::se3, Alignment::sim3})
    EXPECT_THAT(warnings(flight(400), with_random_errors(flight(400)), how), IsEmpty()) << to_string(how);
}

TEST(Explanation, ALeverArmIsFoundWithScale) {
  const Eigen::Vector3d lever(0.8, -0.5, 1.2);
  PoseSeries estimate = with_random_errors(body_of(flight(400), lever));
  const auto found = estimate_lever_arm({flight(400), estimate});
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, EigenNear(lever, 0.03));
  const auto reported = warnings(flight(400), estimate, Alignment::se3);
  ASSERT_THAT(reported, ElementsAre(has_code("lever_arm")));
  EXPECT_THAT(reported[0].text, HasSubstr("--body-from-camera \"0.798 -0.50"));
  for (Eigen::Vector3d& p : estimate.positions_m) p *= 0.4;
  EXPECT_THAT(*estimate_lever_arm({flight(400), estimate}), EigenNear(lever, 0.03)) << "beside a scale";
}

TEST(Explanation, WithoutTurnsThereIsNoLeverArm) {
  PoseSeries straight;
  for (int i = 0; i < 100; ++i) straight.add(Eigen::Matrix3d::Identity(), {0, 0, 0.7 * i});
  EXPECT_FALSE(estimate_lever_arm({straight, straight}));
}

TEST(Explanation, AlongTheOnlyAxisOfTurnsALeverArmStaysZero) {
  PoseSeries car;
  for (int i = 0; i < 300; ++i) {
    const double yaw = 1.5 * std::sin(0.02 * i);
    car.add(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix(),
            {0.3 * std::cos(0.02 * i) * i, 0, 0.7 * i});
  }
  EXPECT_THAT(*estimate_lever_arm({car, body_of(car, {0.4, 2, 0.9})}),
              EigenNear(Eigen::Vector3d(0.4, 0, 0.9), 1e-9));
}

/// Poses of a body that is turned by `angle_deg` about `axis` against the camera.
PoseSeries of_turned_body(PoseSeries camera, double angle_deg, const Eigen::Vector3d& axis) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180, axis).toRotationMatrix();
  for (Eigen::Matrix3d& rotation : camera.rotations) rotation = rotation * R;
  return camera;
}

TEST(Explanation, AConstantRotationOfTheBodyIsFoundWithScale) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 0).normalized();
  for (const double angle_deg : {1.0, 5.0}) {
    PoseSeries estimate = of_turned_body(flight(400), angle_deg, axis);
    const auto exact = estimate_body_rotation({flight(400), estimate});
    ASSERT_TRUE(exact);
    const Eigen::AngleAxisd expected(-angle_deg * std::numbers::pi / 180, axis);
    EXPECT_THAT(exact->body_from_camera, EigenNear(expected.toRotationMatrix(), 5e-4));
    EXPECT_LT(exact->squares_with, 1e-6 * exact->squares_without);
    for (Eigen::Vector3d& p : estimate.positions_m) p *= 0.4;
    EXPECT_THAT(estimate_body_rotation({flight(400), estimate})->body_from_camera,
                EigenNear(expected.toRotationMatrix(), 5e-4))
        << "beside a scale";
    const auto reported = warnings(
        flight(400), of_turned_body(with_random_errors(flight(400)), angle_deg, axis), Alignment::se3);
    ASSERT_THAT(reported, ElementsAre(has_code("body"))) << angle_deg;
    EXPECT_THAT(reported[0].text, HasSubstr(fmt::format("by {:.1f} deg explains", angle_deg)));
  }
}

TEST(Explanation, ALeverArmInAConstantTurnIsNoRotationOfTheBody) {
  PoseSeries circle;
  Eigen::Vector3d p(0, 0, 0);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    circle.add(R, p);
    p += R * Eigen::Vector3d(0, 0.002 * i, 1);
  }
  const PoseSeries estimate = with_random_errors(body_of(circle, {0.3, 0, 1.6}));
  EXPECT_THAT(warnings(circle, estimate, Alignment::se3), ElementsAre(has_code("lever_arm")));
  // The direction of motion differs by 0.05 * 1.6 rad, 4.6 deg, from that of the other point.
  const auto turn = estimate_body_rotation({circle, estimate});
  ASSERT_TRUE(turn);
  EXPECT_LT(rotation_angle_rad(Eigen::Quaterniond(turn->body_from_camera)), 0.01);
}

TEST(Explanation, RotationsInAnotherWorldThanThePositionsAreReported) {
  const PoseSeries truth = flight(400);
  PoseSeries estimate = with_random_errors(truth);
  const Eigen::Matrix3d W = Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix();
  for (Eigen::Matrix3d& R : estimate.rotations) R = W * R;
  for (const Alignment how : {Alignment::none, Alignment::se3}) {
    const auto found = warnings(truth, estimate, how);
    ASSERT_THAT(found, ElementsAre(has_code("world_of_rotations"))) << to_string(how);
    EXPECT_THAT(found[0].text, HasSubstr("turned by 68.8 deg"));
  }
  // A path that is nearly a line leaves the world's rotation about it to noise: nothing is in two worlds.
  PoseSeries line, rolled;
  for (int i = 0; i < 200; ++i) {
    line.add(so3_exp({0.3 * std::sin(0.2 * i), 0.2 * std::sin(0.13 * i), 0}).toRotationMatrix(),
             {0.02 * std::sin(0.1 * i), 0, 0.5 * i});
    rolled.add(line.rotations.back(), {0, 0.02 * std::sin(0.1 * i), 0.5 * i});
  }
  EXPECT_THAT(warnings(line, rolled, Alignment::se3), Not(Contains(has_code("world_of_rotations"))));
}

TEST(Explanation, ATurnOfTheWorldIsReportedButNoDrift) {
  const PoseSeries truth = flight(400);
  const auto reported =
      warnings(truth, turned(with_random_errors(truth), 0.5, Eigen::Vector3d::UnitZ(), {3, 1, 2}));
  ASSERT_THAT(reported, ElementsAre(has_code("yaw")));
  EXPECT_THAT(reported[0].text, AllOf(HasSubstr("28."), HasSubstr("--align yaw --up z")));
  PoseSeries drifting;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.001 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    drifting.add(R * truth.rotations[static_cast<size_t>(i)], R * truth.positions_m[static_cast<size_t>(i)]);
  }
  EXPECT_THAT(warnings(truth, drifting), Not(Contains(has_code("yaw"))));
}

TEST(Explanation, AxesOfEitherSideAreNamed) {
  for (const Axes axes : {Axes::opengl, Axes::ned, Axes::flu}) {
    const std::string name(to_string(axes));
    for (const Alignment how : {Alignment::none, Alignment::origin, Alignment::se3}) {
      SCOPED_TRACE(name + " " + std::string(to_string(how)));
      const auto reported = warnings(flight(400), in_axes(with_random_errors(flight(400)), axes), how);
      ASSERT_THAT(reported, ElementsAre(has_code("axes")));
      EXPECT_THAT(reported[0].text, HasSubstr("--axes " + name));
    }
  }
  EXPECT_THAT(warnings(in_axes(flight(400), Axes::ned), with_random_errors(flight(400)))[0].text,
              HasSubstr("--ref-axes ned"));
}

TEST(Explanation, StampsInAnotherUnitHaveNoOffset) {
  const PoseSeries truth = flight(400);
  for (const double factor : {1e-9, 1e9}) {
    PoseSeries estimate = truth;
    for (double& t : estimate.stamps_s) t *= factor;
    EXPECT_THROW(estimate_offset(truth, estimate, 0, "in another unit"), Error) << factor;
  }
}

/// Negates one axis of world and body, as a conversion to a left-handed frame does.
PoseSeries mirrored(PoseSeries s, int axis) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
  M(axis, axis) = -1;
  for (size_t i = 0; i < s.size(); ++i) {
    s.positions_m[i] = M * s.positions_m[i];
    s.rotations[i] = M * s.rotations[i] * M;
  }
  return s;
}

TEST(Explanation, AMirroredPathIsNamed) {
  for (const int axis : {0, 1, 2}) {
    const std::string remedy =
        std::vector{"negate x, qy and qz", "negate y, qx and qz", "negate z, qx and qy"}[axis];
    const PoseSeries estimate = with_random_errors(mirrored(flight(400), axis));
    for (const Alignment how : {Alignment::none, Alignment::se3, Alignment::sim3}) {
      const auto reported = warnings(flight(400), estimate, how);
      ASSERT_THAT(reported, ElementsAre(has_code("mirrored"))) << axis << " " << to_string(how);
      EXPECT_THAT(reported[0].text, testing::StartsWith("the estimate is mirrored"));
      EXPECT_THAT(reported[0].text, HasSubstr(remedy));
    }
  }
  PoseSeries positions = with_random_errors(flight(400));
  for (Eigen::Vector3d& p : positions.positions_m) p.x() *= -1;
  ASSERT_THAT(warnings(flight(400), positions, Alignment::none), ElementsAre(has_code("mirrored")));
}

TEST(Explanation, QuaternionsInAnotherOrder) {
  for (const Alignment how : {Alignment::none, Alignment::se3}) {
    const auto reported = warnings(flight(400), w_read_last(with_random_errors(flight(400))), how);
    ASSERT_THAT(reported, ElementsAre(has_code("columns")));
    EXPECT_THAT(reported[0].text, HasSubstr("the estimate's quaternions seem to have w first"));
    EXPECT_THAT(warnings(flight(400), w_read_last(flight(400)), how), ElementsAre(has_code("columns")))
        << "positions without any error";
  }
}

TEST(Explanation, TheRmseOfALongPathIsThatOfAllPoses) {
  for (const int n : {400, 2400}) {
    PoseSeries estimate = flight(n);
    for (Eigen::Vector3d& p : estimate.positions_m) p *= 100;
    double squares = 0;
    for (size_t i = 0; i < estimate.size(); ++i)
      squares += (estimate.positions_m[i] - flight(n).positions_m[i]).squaredNorm() / n;
    const auto reported = warnings(flight(n), estimate);
    ASSERT_THAT(reported, ElementsAre(has_code("unit")));
    const size_t at = reported[0].text.find("position RMSE ");
    ASSERT_NE(at, std::string::npos);
    EXPECT_NEAR(std::stod(reported[0].text.substr(at + 14)) / std::sqrt(squares), 1, 0.01) << n;
  }
}

/// Returns the shift in s that a warning "lag" states, positive if the estimate is late; 0 without one.
double reported_lag_s(const std::vector<DataWarning>& reported) {
  const auto lag = std::ranges::find(reported, "lag", &DataWarning::code);
  if (lag == reported.end()) return 0;
  const bool is_late = lag->text.find("late by ") != std::string::npos;
  return (is_late ? 1 : -1) * std::stod(lag->text.substr(lag->text.find(" by ") + 4));
}

TEST(Explanation, AClockThatIsFarOffIsReportedByItsOffset) {
  for (const double late_s : {30.0, -30.0, 5.0}) {
    PoseSeries late = with_random_errors(flight(800));
    for (double& t : late.stamps_s) t += late_s;
    TrajectoryFile file;
    file.poses = late;
    const EgoResult r = evaluate_ego({.poses = flight(800)}, file, "late", {});
    EXPECT_NEAR(reported_lag_s(r.warnings), late_s, 0.06);
    EXPECT_THAT(r.warnings, testing::Not(testing::Contains(has_code("scale"))));
    const OffsetEstimate found = estimate_offset(flight(800), late, 0, "late");
    EXPECT_NEAR(found.offset_s, -late_s, 0.01);
  }
}

std::vector<DataWarning> warnings_with(const PoseSeries& reference, PoseSeries estimate) {
  TrajectoryFile file;
  file.poses = std::move(estimate);
  return evaluate_ego({.poses = reference}, file, "planted", {.alignment = Alignment::se3}).warnings;
}

TEST(Explanation, AClockAtAnotherRateAndAReversedPathAreNoOffset) {
  const PoseSeries truth = flight(400);
  PoseSeries drifting = with_random_errors(truth), half = drifting, reversed = drifting;
  for (double& t : drifting.stamps_s) t = 100 + 1.02 * (t - 100);
  std::vector<int> second, backwards;
  for (int i = 0; i < 400; i += 2) second.push_back(i);
  for (int i = 399; i >= 0; --i) backwards.push_back(i);
  half.keep(second);
  for (double& t : half.stamps_s) t = 100 + 0.5 * (t - 100);
  reversed.keep(backwards);
  reversed.stamps_s = truth.stamps_s;
  for (const auto& [planted, name] : {std::pair(&drifting, "clock_rate"), std::pair(&half, "clock_rate"),
                                      std::pair(&reversed, "reversed")}) {
    const auto found = warnings_with(truth, *planted);
    EXPECT_THAT(found, Contains(has_code(name)));
    EXPECT_THAT(found, Not(Contains(testing::AnyOf(has_code("lag"), has_code("scale")))));
  }
  // Reversed in time, a path that begins at the identity ends there.
  reversed = truth;
  reversed.keep(backwards);
  reversed.stamps_s = truth.stamps_s;
  ASSERT_TRUE(reversed.positions_m.back().isZero(0) && reversed.rotations.back().isIdentity(0));
  EXPECT_THAT(warnings_with(truth, reversed), Not(Contains(has_code("lost_poses"))));
  PoseSeries part = with_random_errors(truth);
  std::vector<int> first;
  for (int i = 0; i < 250; ++i) first.push_back(i);
  part.keep(first);
  EXPECT_THAT(warnings_with(truth, part), Each(has_code("coverage")));
}

// ---- The same mistakes, planted in recorded trajectories.

struct Real {
  EgoReference reference;
  PoseSeries estimate;  ///< with the reference's stamps
};

class PlantedInRealTrajectories : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    SEXTANT_NEEDS_DATA("kitti_tracking_peers");
    real.reference =
        source_reference(std::string("kitti:kitti_tracking#") + GetParam(), real_data(""), Json::object());
    real.reference.warnings.clear();
    const std::string path =
        real_data("kitti_tracking_peers") / "orbslam3_camera" / (std::string(GetParam()) + ".txt");
    TrajectoryFile file = read_trajectory(path, "kitti");
    const EgoResult matched = evaluate_ego(real.reference, file, path, {});
    EXPECT_THAT(matched.warnings, IsEmpty());
    rmse = matched.statistics.rmse;
    real.estimate = file.poses;
    real.estimate.keep(matched.reference_rows);
    real.estimate.frames.clear();
    real.estimate.stamps_s = matched.reference.stamps_s;
  }
  EgoResult evaluate(PoseSeries estimate, const EgoOptions& options = {}) const {
    TrajectoryFile file;
    file.poses = std::move(estimate);
    return evaluate_ego(real.reference, std::move(file), "planted", options);
  }
  Real real;
  double rmse = 0;  ///< of the recording without a planted mistake
};

TEST_P(PlantedInRealTrajectories, LeverArm) {
  const Eigen::Vector3d lever(0.8, -0.5, 1.2);
  EgoOptions options{.alignment = Alignment::sim3};
  const double before = evaluate(real.estimate, options).statistics.rmse;
  const EgoResult planted = evaluate(body_of(real.estimate, lever), options);
  EXPECT_THAT(planted.warnings, Contains(has_code("lever_arm")));
  PoseSeries reference = real.reference.poses;
  reference.keep(planted.reference_rows);
  const Eigen::Vector3d found = *estimate_lever_arm({reference, body_of(real.estimate, lever)});
  RecordProperty("lever_m", fmt::format("{:.3f} {:.3f} {:.3f}", found[0], found[1], found[2]));
  EXPECT_NEAR(found[0], lever[0], 0.3);
  EXPECT_NEAR(found[2], lever[2], 0.3);
  options.estimate_frame.body_from_camera = BodyFromCamera{lever, {}};
  EXPECT_NEAR(evaluate(body_of(real.estimate, lever), options).statistics.rmse, before, 1e-9);
}

TEST_P(PlantedInRealTrajectories, Yaw) {
  const Eigen::Vector3d up = -Eigen::Vector3d::UnitY();
  EgoOptions options{.alignment = Alignment::yaw, .up = up};
  const EgoResult before = evaluate(real.estimate, options);
  const PoseSeries planted = turned(real.estimate, 25 * EIGEN_PI / 180, up, {3, 0, -2});
  EXPECT_THAT(evaluate(planted).warnings, Contains(has_code("yaw")));
  const EgoResult mended = evaluate(planted, options);
  EXPECT_NEAR(mended.statistics.rmse, before.statistics.rmse, 1e-9);
  const auto angle = [&](const EgoResult& r) {
    return so3_log(Eigen::Quaterniond(r.alignment.ref_from_est.rotation)).dot(up) * 180 / EIGEN_PI;
  };
  EXPECT_NEAR(angle(mended) - angle(before), -25, 1e-9);
}

TEST_P(PlantedInRealTrajectories, TimeOffset) {
  EgoOptions options{.interpolate_max_gap_s = 0.3, .estimate_offset = true};
  const OffsetEstimate own = *evaluate(real.estimate, options).offset;
  RecordProperty("own_offset_ms", fmt::format("{:.1f} [{:.1f}, {:.1f}]", 1e3 * own.offset_s, 1e3 * own.low_s,
                                              1e3 * own.high_s));
  EXPECT_LT(std::abs(own.offset_s), 0.02);
  for (const double late_s : {0.25, 0.04, -0.13, 5.0}) {
    PoseSeries planted = real.estimate;
    for (double& t : planted.stamps_s) t += late_s;
    const EgoResult r = evaluate(planted, options);
    EXPECT_NEAR(r.offset->offset_s, own.offset_s - late_s, 0.001) << late_s;
    EXPECT_LT(r.offset->high_s - r.offset->low_s, 0.1);
    EXPECT_THAT(r.warnings, Not(Contains(has_code("lag"))));
    EgoOptions nearest;
    nearest.association.max_difference_s = 0.06;
    if (late_s == 0.25) {
      EXPECT_THAT(evaluate(planted, nearest).warnings, Contains(has_code("lag")));
    }
    const EgoOptions aligned{.alignment = Alignment::sim3, .interpolate_max_gap_s = 0.3};
    const EgoResult reported = evaluate(planted, aligned);
    const double times = reported.statistics.rmse / evaluate(real.estimate, aligned).statistics.rmse;
    RecordProperty(fmt::format("rmse_times_{:.0f}_ms", 1e3 * late_s), fmt::format("{:.2f}", times));
    if (late_s > 1) {
      EXPECT_NEAR(reported_lag_s(reported.warnings), late_s, 0.06);
    } else if (times * times > 2.5) {  // the shift causes most of the squared error
      EXPECT_THAT(reported.warnings, Contains(has_code("lag"))) << late_s << " s late";
    }
  }
}

TEST_P(PlantedInRealTrajectories, AnotherRecordingHasNoOffset) {
  EgoFiles files{.reference = "kitti:" + real_data("kitti_tracking").string() + "#0003",
                 .estimate_format = "kitti"};
  files.estimates = {(real_data("kitti_tracking_peers") / "orbslam3_camera").string() + "/" + GetParam() +
                     ".txt"};
  for (const EgoResult& r : evaluate_ego_files(files, {.alignment = Alignment::se3}).runs)
    EXPECT_THAT(r.warnings, Not(Contains(has_code("lag"))));
}

TEST_P(PlantedInRealTrajectories, AClockThatIsFarOff) {
  EgoOptions options{.interpolate_max_gap_s = 0.3, .estimate_offset = true};
  const double own_s = evaluate(real.estimate, options).offset->offset_s;
  for (const double late_s : {30.0, -8.0}) {
    PoseSeries planted = real.estimate;
    for (double& t : planted.stamps_s) t += late_s;
    EXPECT_NEAR(evaluate(planted, options).offset->offset_s, own_s - late_s, 0.001) << late_s;
  }
}

TEST_P(PlantedInRealTrajectories, InverseEstimates) {
  PoseSeries planted = real.estimate;
  invert(planted);
  for (const Alignment how : {Alignment::none, Alignment::se3, Alignment::sim3}) {
    const EgoResult r = evaluate(planted, {.alignment = how});
    const auto inverse = std::ranges::find(r.warnings, "inverse", &DataWarning::code);
    ASSERT_NE(inverse, r.warnings.end()) << to_string(how);
    EXPECT_THAT(inverse->text, StartsWith("the estimate holds inverse poses")) << to_string(how);
    EXPECT_THAT(inverse->text, HasSubstr("--ref-inverse")) << to_string(how);
  }
}

TEST_P(PlantedInRealTrajectories, AxesAndColumns) {
  for (const Axes axes : {Axes::opengl, Axes::ned, Axes::flu}) {
    const std::string name(to_string(axes));
    const PoseSeries planted = in_axes(real.estimate, axes);
    EXPECT_THAT(evaluate(planted).warnings, Contains(has_code("axes"))) << name;
    EgoOptions options;
    options.estimate_frame.axes = axes;
    EXPECT_NEAR(evaluate(planted, options).statistics.rmse, rmse, 1e-9) << name;
  }
  EXPECT_THAT(evaluate(w_read_last(real.estimate)).warnings, Contains(has_code("columns")));
}

TEST_P(PlantedInRealTrajectories, Mirrored) {
  for (const int axis : {0, 2}) {
    for (const Alignment how : {Alignment::none, Alignment::se3, Alignment::sim3}) {
      const EgoResult r = evaluate(mirrored(real.estimate, axis), {.alignment = how});
      EXPECT_THAT(r.warnings, Contains(has_code("mirrored"))) << axis << " " << to_string(how);
    }
  }
}

TEST_P(PlantedInRealTrajectories, ColumnOrder) {
  std::string named = "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw\n", bare;
  for (size_t i = 0; i < real.estimate.size(); ++i) {
    const Eigen::Quaterniond q = real.estimate.pose(i).rotation();
    const Eigen::Vector3d& p = real.estimate.positions_m[i];
    bare +=
        fmt::format("{:.0f},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n",
                    1e9 * (real.estimate.stamps_s[i] + 1.4e9), p[0], p[1], p[2], q.x(), q.y(), q.z(), q.w());
  }
  EgoOptions options{.relation = PoseRelation::angle_deg};
  options.association.offset_s = -1.4e9;
  const double before = evaluate(real.estimate, {.relation = PoseRelation::angle_deg}).statistics.rmse;
  const EgoResult read = evaluate(decode_trajectory(named + bare, "auto").poses, options);
  EXPECT_NEAR(read.statistics.rmse, before, 1e-6);
  expect_error([&] { decode_trajectory(bare, "auto"); }, "euroc");
}

INSTANTIATE_TEST_SUITE_P(Kitti, PlantedInRealTrajectories, testing::Values("0000", "0004", "0006"));

}  // namespace
}  // namespace sextant
