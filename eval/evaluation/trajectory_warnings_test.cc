#include "sextant/eval/evaluation/trajectory_warnings.h"

#include <cmath>
#include <random>

#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/ego_drive_testing.h"

namespace sextant {
namespace {

TEST(TrajectoryWarnings, AGoodPairHasNoWarning) {
  EXPECT_THAT(evaluate(drive(300, 10), noisy(drive(300, 10))).warnings, IsEmpty());
  EXPECT_THAT(evaluate(drive(300, 10), noisy(drive(300, 10, 0.0005))).warnings, IsEmpty());
}

TEST(TrajectoryWarnings, ScaleIsReportedUnlessCorrected) {
  const PoseSeries half = noisy(drive(300, 10, 0, 0.5));
  EgoOptions options{.alignment = Alignment::se3};
  EXPECT_THAT(evaluate(drive(300, 10), half, options).warnings, Contains(code("scale")));
  options.alignment = Alignment::sim3;
  const EgoResult scaled = evaluate(drive(300, 10), half, options);
  EXPECT_THAT(scaled.warnings, IsEmpty());
  EXPECT_NEAR(scaled.alignment.ref_from_est.scale, 2, 1e-2);
}

TEST(TrajectoryWarnings, DifferentRatesAreReported) {
  EXPECT_THAT(evaluate(drive(900, 30), noisy(drive(300, 10))).warnings, ElementsAre(code("rates")));
}

TEST(TrajectoryWarnings, AnInterpolatedReferenceHasTheRateOfTheEstimate) {
  const EgoResult r = evaluate(drive(100, 2), noisy(drive(490, 10)), {.interpolate_max_gap_s = 0.6});
  EXPECT_THAT(r.warnings,
              Contains(testing::AllOf(code("rates"), text("errors in frames span the estimate's steps"))));
  EXPECT_THAT(r.warnings, Not(Contains(text("matched at the lower one"))));
}

TEST(TrajectoryWarnings, ADenserAndLongerEstimateMayBeTheTruth) {
  EXPECT_THAT(evaluate(drive(200, 10), noisy(drive(900, 30))).warnings, Contains(code("swapped")));
}

TEST(TrajectoryWarnings, ASparseReferenceIsNoEstimate) {
  EXPECT_THAT(evaluate(drive(20, 1), noisy(drive(400, 20))).warnings, ElementsAre(code("rates")));
  PoseSeries positions = drive(200, 10);  // of GNSS or a prism
  positions.rotations.clear();
  EXPECT_THAT(evaluate(positions, noisy(drive(900, 30))).warnings, Not(Contains(code("swapped"))));
}

TEST(TrajectoryWarnings, NamesAndCommentsReportSwappedSides) {
  const auto warnings = [](const std::string& reference, const std::string& estimate,
                           const std::string& comments) {
    return warnings_of_pair(drive(50, 10), {reference, "", "tum"}, drive(50, 10),
                            {estimate, comments, "tum"});
  };
  EXPECT_THAT(warnings("orb.txt", "groundtruth.txt", ""), Contains(code("swapped")));
  EXPECT_THAT(warnings("x/est_1.txt", "x/gt_1.txt", ""), Contains(code("swapped")));
  EXPECT_THAT(warnings("a.txt", "b.txt", "# ground truth trajectory\n"), Contains(code("swapped")));
  EXPECT_THAT(warnings("CameraTrajectory_ORB-SLAM3.txt", "poses.txt", ""), Contains(code("swapped")));
  EXPECT_THAT(warnings("gt.txt", "est.txt", ""), IsEmpty());
  EXPECT_THAT(warnings("groundtruth_slam.txt", "groundtruth_of_b.txt", ""), IsEmpty());
  EXPECT_THAT(warnings("right.txt", "best.txt", ""),
              IsEmpty());  // hold "gt"-like and "est" as parts of words
}

TEST(TrajectoryWarnings, UnmatchedPosesAndCoverage) {
  PoseSeries estimate = noisy(drive(300, 10));
  for (size_t i = 0; i < 100; ++i) estimate.stamps_s[200 + i] += 0.05;
  const EgoResult r = evaluate(drive(300, 10), estimate);
  EXPECT_THAT(r.warnings, Contains(code("unmatched")));
  EXPECT_THAT(r.warnings, Contains(code("coverage")));
  EXPECT_EQ(r.errors.size(), 200);
}

TEST(TrajectoryWarnings, AConstantLagIsFoundWithItsSignAndSize) {
  // The estimate's poses carry stamps 0.3 s too late: at stamp t it is where the truth was at t - 0.3.
  for (const double lag_s : {0.3, -0.5}) {
    const EgoResult r = evaluate(drive(600, 10), noisy(drive(600, 10, -lag_s)));
    ASSERT_THAT(r.warnings, Contains(code("lag")));
    const std::string& said = std::ranges::find(r.warnings, "lag", &DataWarning::code)->text;
    ASSERT_THAT(said, testing::HasSubstr("% interval "));
    EXPECT_NEAR(std::stod(said.substr(said.find("interval ") + 9)), std::abs(lag_s), 0.01) << said;
    EXPECT_NEAR(estimate_offset(drive(600, 10), noisy(drive(600, 10, -lag_s)), 0, "late").offset_s, -lag_s,
                0.01);
  }
  EgoOptions repaired;
  repaired.association.offset_s = -0.3;
  const EgoResult r = evaluate(drive(600, 10), noisy(drive(600, 10, -0.3)), repaired);
  EXPECT_LT(r.statistics.rmse, 0.02);
  EXPECT_THAT(r.warnings, Not(Contains(code("lag"))));
}

TEST(TrajectoryWarnings, LostPosesAreNoLag) {
  PoseSeries lost = noisy(drive(300, 10));
  for (size_t i = 180; i < 300; ++i) {
    lost.rotations[i].setIdentity();
    lost.positions_m[i].setZero();
  }
  EgoOptions whole, begin;
  begin.association.end_s = 115;  // before the first lost pose
  EXPECT_THAT(evaluate(drive(300, 10), lost, whole).warnings,
              AllOf(Contains(code("lost_poses")), Not(Contains(code("lag")))));
  EXPECT_THAT(evaluate(drive(300, 10), lost, begin).warnings, IsEmpty());
}

TEST(TrajectoryWarnings, AShortLagOfASmoothDriveIsFound) {
  for (const double lag_s : {0.1, -0.06, 0.8}) {
    const PoseSeries truth = drive(2000, 50), late = noisy(drive(2000, 50, -lag_s));
    EXPECT_THAT(evaluate(truth, late).warnings, Contains(code("lag"))) << lag_s;
    EXPECT_NEAR(estimate_offset(truth, late, 0, "late").offset_s, -lag_s, 0.002);
  }
  EXPECT_THAT(evaluate(drive(2000, 50), noisy(drive(2000, 50))).warnings, IsEmpty());
}

TEST(TrajectoryWarnings, AShiftBelowAStepIsReportedWhenItExplainsTheError) {
  for (const double shift_s : {0.004, -0.03, 0.045}) {
    for (const Alignment how : {Alignment::none, Alignment::origin, Alignment::se3, Alignment::sim3}) {
      SCOPED_TRACE(fmt::format("{} s, {}", shift_s, to_string(how)));
      const PoseSeries estimate = noisy(drive(300, 10, shift_s));
      EgoOptions options{.alignment = how};
      const EgoResult r = evaluate(drive(300, 10), estimate, options);
      ASSERT_THAT(r.warnings, ElementsAre(code("lag")));
      EXPECT_THAT(r.warnings, Contains(text(shift_s < 0 ? "is late by 0.03 s" : "is early by 0.0")));
      EXPECT_THAT(r.warnings, Contains(text("--estimate-offset")));
      options.association.offset_s = shift_s;
      options.interpolate_max_gap_s = 0.3;
      EXPECT_THAT(evaluate(drive(300, 10), estimate, options).warnings, IsEmpty());
    }
  }
}

TEST(TrajectoryWarnings, AShiftOfRowsIsFoundAmongErrorsThatAreIndependentFromPoseToPose) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const int n : {60, 300}) {
    for (const int shift : {0, 1, 3}) {
      PoseSeries reference = drive(n, 10), estimate = drive(n, 10, -0.1 * shift);
      reference.stamps_s.clear();
      estimate.stamps_s.clear();
      for (size_t i = 0; i < estimate.size(); ++i) {
        estimate.rotations[i] *=
            Eigen::AngleAxisd(0.002 * normal(random), Eigen::Vector3d::UnitY()).toRotationMatrix();
        for (int c = 0; c < 3; ++c) estimate.positions_m[i][c] += 0.02 * normal(random);
      }
      const auto warnings = evaluate(reference, estimate).warnings;
      if (shift == 0) {
        EXPECT_THAT(warnings, IsEmpty()) << n;
      } else {
        EXPECT_THAT(warnings, Contains(code("lag"))) << n << " poses, " << shift << " rows";
      }
    }
  }
}

TEST(TrajectoryWarnings, WhatAShiftOfTheClockWouldExplainAsWellIsNotReportedAsOne) {
  PoseSeries longer = noisy(drive(300, 10, 0, 1.02)), beside = noisy(drive(300, 10));
  for (size_t i = 0; i < beside.size(); ++i)
    beside.positions_m[i] += beside.rotations[i] * Eigen::Vector3d(0, 0, 0.5);
  for (const Alignment how : {Alignment::none, Alignment::origin, Alignment::se3}) {
    EXPECT_THAT(evaluate(drive(300, 10), longer, {.alignment = how}).warnings, Not(Contains(code("lag"))));
    EXPECT_THAT(evaluate(drive(300, 10), beside, {.alignment = how}).warnings,
                ElementsAre(code("lever_arm")));
  }
}

TEST(TrajectoryWarnings, ALostTrackerThatRepeatsItsPose) {
  PoseSeries estimate = noisy(drive(300, 10));
  for (size_t i = 150; i < 160; ++i) {
    estimate.positions_m[i] = estimate.positions_m[149];
    estimate.rotations[i] = estimate.rotations[149];
  }
  EXPECT_THAT(evaluate(drive(300, 10), estimate).warnings,
              Contains(text("repeats its last pose exactly 10 times")));
}

TEST(TrajectoryWarnings, LostFramesThatAreWrittenAsIdentityAreNamed) {
  for (const size_t every : {10U, 40U, 200U}) {
    PoseSeries estimate = noisy(drive(300, 10));
    for (size_t i = 0; i < 300; i += every) {
      estimate.positions_m[i].setZero();
      estimate.rotations[i].setIdentity();
    }
    const EgoResult r = evaluate(drive(300, 10), estimate, {.alignment = Alignment::se3});
    const std::string count =
        every == 200 ? "1 pose of the estimate is" : fmt::format("{} poses", 299 / every);
    EXPECT_THAT(r.warnings, Contains(AllOf(code("lost_poses"), text(count),
                                           text(fmt::format("first at matched pose {},", every)))));
    EXPECT_THAT(r.warnings, Not(Contains(testing::AnyOf(code("scale"), code("jump")))));
  }
}

TEST(TrajectoryWarnings, AnEstimateThatStandsAtItsOriginHasLostNoPose) {
  PoseSeries reference = drive(300, 10), estimate = noisy(drive(300, 10));
  for (size_t i = 0; i < 40; ++i) {
    for (PoseSeries* s : {&reference, &estimate}) {
      s->positions_m[i] = {s == &estimate && i % 5 == 4 ? 0.001 : 0, 0, 0};  // written with three digits
      s->rotations[i].setIdentity();
    }
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("lost_poses"))));
}

TEST(TrajectoryWarnings, ATrackerThatStartsAgainElsewhereIsReportedWithThePlace) {
  const EgoOptions options{.alignment = Alignment::se3};
  PoseSeries estimate = noisy(drive(300, 10));
  const Eigen::Vector3d origin = estimate.positions_m[150];
  for (size_t i = 150; i < 300; ++i) estimate.positions_m[i] -= origin;
  EXPECT_THAT(evaluate(drive(300, 10), estimate, options).warnings,
              Contains(AllOf(code("jump"), text("before matched pose 150;"))));
  estimate = noisy(drive(300, 10));
  estimate.positions_m[70].setZero();  // a lost pose that was logged as zero
  EXPECT_THAT(evaluate(drive(300, 10), estimate, options).warnings,
              Contains(AllOf(code("jump"), text("before matched pose 70, 71;"))));
}

TEST(TrajectoryWarnings, GapsDriftAndAnotherScaleAreNoJumps) {
  PoseSeries estimate = noisy(drive(300, 10, 0, 0.5)), reference = drive(300, 10);
  for (PoseSeries* s : {&estimate, &reference}) {
    s->positions_m.erase(s->positions_m.begin() + 50, s->positions_m.begin() + 90);
    s->rotations.erase(s->rotations.begin() + 50, s->rotations.begin() + 90);
    s->stamps_s.erase(s->stamps_s.begin() + 50, s->stamps_s.begin() + 90);
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("jump"))));
  estimate = drive(300, 10);
  for (size_t i = 0; i < 300; ++i) estimate.positions_m[i] *= 1 + 0.002 * static_cast<double>(i);
  EXPECT_THAT(evaluate(drive(300, 10), estimate).warnings, Not(Contains(code("jump"))));
}

TEST(TrajectoryWarnings, AStandstillIsNoLostTracker) {
  PoseSeries reference = drive(300, 10), estimate = noisy(drive(300, 10));
  for (size_t i = 150; i < 200; ++i) {
    for (PoseSeries* s : {&reference, &estimate}) {
      s->positions_m[i] = s->positions_m[149];
      s->rotations[i] = s->rotations[149];
    }
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("repeated_poses"))));
}

TEST(TrajectoryWarnings, EqualRotationsBesideOnesThatTurnAreReported) {
  PoseSeries without = noisy(drive(300, 10));
  for (Eigen::Matrix3d& R : without.rotations) R = drive(1, 10).rotations[0];
  EXPECT_THAT(evaluate(drive(300, 10), without).warnings,
              Contains(AllOf(code("no_rotations"), text("all rotations of the estimate are equal"),
                             text("--est-format positions"))));
  EXPECT_THAT(evaluate(without, noisy(drive(300, 10))).warnings,
              Contains(AllOf(code("no_rotations"), text("--ref-format positions"))));
  EXPECT_THAT(evaluate(without, noisy(without)).warnings, Not(Contains(code("no_rotations"))));
}

TEST(TrajectoryWarnings, RoundedPositionsAreReportedWhereTheyExplainTheErrors) {
  const auto rounded = [](PoseSeries s, double step_m) {
    for (Eigen::Vector3d& p : s.positions_m)
      p = step_m * (p / step_m).unaryExpr([](double value) { return std::round(value); });
    return s;
  };
  for (const double step_m : {1.0, 0.1}) {
    EXPECT_THAT(evaluate(drive(300, 10), rounded(noisy(drive(300, 10)), step_m)).warnings,
                ElementsAre(AllOf(code("rounded"),
                                  text(fmt::format("of the estimate are multiples of {:g} m", step_m)))));
    EXPECT_THAT(evaluate(rounded(drive(300, 10), step_m), noisy(drive(300, 10))).warnings,
                ElementsAre(AllOf(code("rounded"), text("positions of the reference"))));
  }
  EXPECT_THAT(evaluate(drive(300, 10), rounded(noisy(drive(300, 10)), 0.001)).warnings, IsEmpty());
}

TEST(TrajectoryWarnings, ErrorsThatAccumulateAreNoRounding) {
  // A simulated path whose positions are exact multiples of 0.1 m; a scale error of about the same size.
  const PoseSeries line = vehicle(
      60, 10, [](double) { return 8.0; }, [](double) { return 0.0; });
  PoseSeries exact = line;
  for (size_t i = 0; i < exact.size(); ++i) exact.positions_m[i] = {0, 0, 0.8 * static_cast<double>(i)};
  for (unsigned seed = 0; seed < 8; ++seed) {
    const auto warnings = evaluate(exact, with_step_errors(exact, seed, 0.02, 1.03)).warnings;
    EXPECT_THAT(warnings, Not(Contains(code("rounded")))) << seed;
  }
}

TEST(TrajectoryWarnings, APoseThatIsHeldIsNoLostFrame) {
  PoseSeries held = noisy(drive(300, 10));
  held.positions_m[0].setZero();
  held.rotations[0].setIdentity();
  for (size_t i = 0; i < held.size(); ++i) {
    held.positions_m[i] = held.positions_m[i / 5 * 5];
    held.rotations[i] = held.rotations[i / 5 * 5];
  }
  const auto warnings = evaluate(drive(300, 10), held).warnings;
  EXPECT_THAT(warnings, Contains(code("repeated_poses")));
  EXPECT_THAT(warnings, Not(Contains(code("lost_poses"))));
}

TEST(TrajectoryWarnings, IdentityTruthAndTheSameFileTwice) {
  PoseSeries reference = drive(300, 10);
  reference.positions_m[20].setZero();
  reference.rotations[20].setIdentity();
  EXPECT_THAT(evaluate(reference, noisy(drive(300, 10))).warnings, Contains(code("identity")));
  EXPECT_THAT(evaluate(drive(300, 10), drive(300, 10)).warnings, Contains(code("identical")));
}

TEST(TrajectoryWarnings, StandingAtTheOriginFirstIsNoMissingTruth) {
  PoseSeries reference = drive(300, 10), estimate = noisy(drive(300, 10));
  for (size_t i = 0; i < 40; ++i) {
    reference.positions_m[i].setZero();
    reference.rotations[i].setIdentity();
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Contains(code("identity"))) << "the estimate moves";
  for (size_t i = 0; i < 40; ++i) estimate.positions_m[i] = {0.01 * static_cast<double>(i % 3), 0, 0};
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("identity"))));
}

TEST(TrajectoryWarnings, ALineLeavesARotationOpen) {
  PoseSeries line;
  for (int i = 0; i < 50; ++i) {
    line.add(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.3 * i, 0.1 * i, 0.7 * i + (i == 20 ? 1e-6 : 0)));
    line.frames.push_back(i);
  }
  EXPECT_THAT(evaluate(line, line, {.alignment = Alignment::se3}).warnings, Contains(code("line")));
}

TEST(TrajectoryWarnings, AStraightPathDeterminesTheScale) {
  PoseSeries line, third;
  for (int i = 0; i < 60; ++i) {
    line.add(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, 0.8 * i));
    line.frames.push_back(i);
  }
  third = line;
  for (Eigen::Vector3d& p : third.positions_m) p *= 0.3;
  const EgoResult declared = evaluate(line, third);
  EXPECT_NEAR(declared.umeyama_scale.value_or(0), 1 / 0.3, 1e-9);
  EXPECT_THAT(declared.warnings, ElementsAre(AllOf(code("scale"), text("needs --align scale"))));
  const EgoResult scaled = evaluate(line, third, {.alignment = Alignment::scale});
  EXPECT_LT(scaled.statistics.rmse, 1e-9);
  EXPECT_THAT(scaled.warnings, IsEmpty());
  for (Eigen::Vector3d& p : third.positions_m) p.setZero();
  EXPECT_FALSE(evaluate(line, third).umeyama_scale);
  expect_error([&] { evaluate(line, third, {.alignment = Alignment::scale}); },
               "leaves the scale undetermined");
}

TEST(TrajectoryWarnings, ANearlyStraightPathLeavesErrorsOfRotationUncertain) {
  const auto nearly_straight = [](double across_m, double error_m) {
    PoseSeries s;
    for (int i = 0; i < 30; ++i) {
      const double x = across_m * std::sin(0.2 * i) + error_m * std::sin(37.0 * i);
      s.add(Eigen::Matrix3d::Identity(), Eigen::Vector3d(x, error_m * std::cos(23.0 * i), 0.7 * i));
      s.frames.push_back(i);
    }
    return s;
  };
  const auto warnings = [&](double across_m, EgoOptions options) {
    return evaluate(nearly_straight(across_m, 0), nearly_straight(across_m, 0.001), options).warnings;
  };
  using enum PoseRelation;
  for (const PoseRelation relation : {angle_deg, angle_rad, rot_part, full}) {
    const EgoOptions options{.alignment = Alignment::se3, .relation = relation};
    EXPECT_THAT(warnings(0.005, options), ElementsAre(code("line"))) << to_string(relation);
    EXPECT_THAT(warnings(0.5, options), IsEmpty()) << to_string(relation);
  }
  const auto found = warnings(0.005, {.alignment = Alignment::sim3, .relation = angle_deg});
  EXPECT_THAT(found, ElementsAre(text("standard error of 3")));
  EXPECT_THAT(found, ElementsAre(text("--align origin or yaw")));
  EXPECT_THAT(warnings(0.005, {.alignment = Alignment::se3, .relation = trans_part}), IsEmpty());
  EXPECT_THAT(warnings(0.005, {.alignment = Alignment::origin, .relation = angle_deg}), IsEmpty());
  const EgoOptions relative{
      .alignment = Alignment::se3, .relation = angle_deg, .rpe_lengths = {PairSelection{}}};
  EXPECT_THAT(warnings(0.005, relative), IsEmpty()) << "a common rotation leaves relative errors unchanged";
}

TEST(TrajectoryWarnings, RowsThatAreTakenAsFramesAreReported) {
  PoseSeries reference = drive(60, 10), estimate = noisy(drive(60, 10));
  reference.stamps_s.clear();
  estimate.stamps_s.clear();
  for (int i = 0; i < 60; ++i) reference.frames.push_back(i);
  EXPECT_THAT(evaluate(reference, estimate).warnings, IsEmpty());
  for (int& frame : reference.frames) frame += 20;
  EXPECT_THAT(evaluate(reference, estimate).warnings, Contains(code("rows")));
}

TEST(TrajectoryWarnings, StampsThatAreNoSecondsAreReported) {
  PoseSeries reference = drive(60, 10), estimate = noisy(drive(60, 10));
  for (PoseSeries* s : {&reference, &estimate}) {
    for (double& t : s->stamps_s) t *= 1e9;
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Contains(code("clock")));
}

}  // namespace
}  // namespace sextant
