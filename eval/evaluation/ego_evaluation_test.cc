#include "sextant/eval/evaluation/ego_evaluation.h"

#include <cmath>
#include <random>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/ego_report.h"

namespace sextant {
namespace {
using testing::Field;

auto code(const std::string& name) { return Field("code", &TrajectoryWarning::code, name); }
auto text(const std::string& part) { return Field("text", &TrajectoryWarning::text, HasSubstr(part)); }

/// A drive with varying speeds and turns, sampled at the times t = i / rate + shift.
PoseSeries drive(int n, double rate_hz, double shift_s = 0, double scale = 1) {
  PoseSeries s;
  for (int i = 0; i < n; ++i) {
    const double t = i / rate_hz + shift_s;
    const double yaw = 0.6 * std::sin(0.7 * t) + 0.3 * std::sin(1.9 * t);
    s.add(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix(),
          scale * Eigen::Vector3d(5 * std::sin(0.5 * t), 0.2 * std::sin(t), 8 * t + 3 * std::sin(1.3 * t)));
    s.stamps_s.push_back(100 + i / rate_hz);
  }
  return s;
}

EgoReference reference_of(PoseSeries poses, const std::string& name = "a.txt") {
  EgoReference reference;
  reference.poses = std::move(poses);
  reference.side.name = name;
  return reference;
}

EgoResult evaluate(PoseSeries reference, PoseSeries estimate, const EgoOptions& options = {}) {
  TrajectoryFile file;
  file.poses = std::move(estimate);
  return evaluate_ego(reference_of(std::move(reference)), std::move(file), "b.txt", options);
}

PoseSeries noisy(PoseSeries s) {
  for (size_t i = 0; i < s.size(); ++i) s.positions_m[i][0] += 0.01 * std::sin(37.0 * static_cast<double>(i));
  return s;
}

TEST(EgoEvaluation, AGoodPairHasNoWarning) {
  EXPECT_THAT(evaluate(drive(300, 10), noisy(drive(300, 10))).warnings, IsEmpty());
  EXPECT_THAT(evaluate(drive(300, 10), noisy(drive(300, 10, 0.0005))).warnings, IsEmpty());
}

TEST(EgoEvaluation, ScaleIsReportedUnlessCorrected) {
  const PoseSeries half = noisy(drive(300, 10, 0, 0.5));
  EgoOptions options{.alignment = Alignment::se3};
  EXPECT_THAT(evaluate(drive(300, 10), half, options).warnings, Contains(code("scale")));
  options.alignment = Alignment::sim3;
  const EgoResult scaled = evaluate(drive(300, 10), half, options);
  EXPECT_THAT(scaled.warnings, IsEmpty());
  EXPECT_NEAR(scaled.alignment.ref_from_est.scale, 2, 1e-2);
}

TEST(EgoEvaluation, DifferentRatesAreReported) {
  EXPECT_THAT(evaluate(drive(900, 30), noisy(drive(300, 10))).warnings, ElementsAre(code("rates")));
}

TEST(EgoEvaluation, AnInterpolatedReferenceHasTheRateOfTheEstimate) {
  const EgoResult r = evaluate(drive(100, 2), noisy(drive(490, 10)), {.interpolate_max_gap_s = 0.6});
  EXPECT_THAT(r.warnings,
              Contains(testing::AllOf(code("rates"), text("errors in frames span the estimate's steps"))));
  EXPECT_THAT(r.warnings, Not(Contains(text("matched at the lower one"))));
}

TEST(EgoEvaluation, ARangeOfTimeIsNoLackOfPartners) {
  EgoOptions options;
  options.association.start_s = 105;
  options.association.end_s = 115;
  for (const double offset_s : {0.0, -500.0}) {
    PoseSeries estimate = noisy(drive(300, 10));
    for (double& t : estimate.stamps_s) t -= offset_s;
    options.association.offset_s = offset_s;
    const EgoResult r = evaluate(drive(300, 10), estimate, options);
    EXPECT_THAT(r.warnings, IsEmpty()) << offset_s;
    EXPECT_EQ(r.errors.size(), 101);
    for (size_t i = 70; i < estimate.size(); ++i) estimate.stamps_s[i] += 0.05;
    const EgoResult less = evaluate(drive(300, 10), estimate, options);
    EXPECT_THAT(less.warnings, Contains(text("only 20 of 100 poses (20 %) have a partner")));
    EXPECT_THAT(less.warnings, Contains(text("the estimate covers 19 % of the reference's duration")));
  }
  PoseSeries frames = noisy(drive(300, 10)), reference = drive(300, 10);
  for (int i = 0; i < 300; ++i) frames.frames.push_back(i);
  reference.frames = frames.frames;
  frames.stamps_s.clear();
  options.association.offset_s = 0;
  EXPECT_THAT(evaluate(reference, frames, options).warnings, IsEmpty()) << "matched by frame number";
}

TEST(EgoEvaluation, FlagsOfTimesNeedTimes) {
  PoseSeries reference = drive(50, 10), estimate = noisy(drive(50, 10));
  reference.stamps_s.clear();
  for (const bool both : {false, true}) {
    if (both) estimate.stamps_s.clear();
    for (int i = 0; i < 50 && !both; ++i) estimate.frames.push_back(i);
    EgoOptions options;
    EXPECT_EQ(evaluate(reference, estimate, options).errors.size(), 50);
    options.association.offset_s = 0.1;
    expect_error([&] { evaluate(reference, estimate, options); }, "--offset needs time stamps in both");
    options.association = {.max_difference_s = 0.05};
    expect_error([&] { evaluate(reference, estimate, options); }, "--max-difference needs time stamps");
  }
}

TEST(EgoEvaluation, AnEstimatedOffsetIsAdvisedWithInterpolation) {
  const PoseSeries truth = drive(600, 10), late = noisy(drive(600, 10, -0.25));
  EgoOptions options;
  EXPECT_THAT(evaluate(truth, late, options).warnings,
              Contains(text("--estimate-offset --interpolate 0.15")));
  options.estimate_offset = true;
  expect_error([&] { evaluate(truth, late, options); }, "give --interpolate 0.15 too");
  options.interpolate_max_gap_s = 0.15;
  EXPECT_THAT(evaluate(truth, late, options).warnings, IsEmpty());
  options.estimate_offset = false;
  const EgoResult interpolated = evaluate(truth, late, options);
  EXPECT_THAT(interpolated.warnings, Contains(text("or --estimate-offset")));
  EXPECT_THAT(interpolated.warnings, Not(Contains(text("--estimate-offset --interpolate"))));
}

TEST(EgoEvaluation, ADenserAndLongerEstimateMayBeTheTruth) {
  EXPECT_THAT(evaluate(drive(200, 10), noisy(drive(900, 30))).warnings, Contains(code("swapped")));
}

TEST(EgoEvaluation, NamesAndCommentsReportSwappedSides) {
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

TEST(EgoEvaluation, UnmatchedPosesAndCoverage) {
  PoseSeries estimate = noisy(drive(300, 10));
  for (size_t i = 0; i < 100; ++i) estimate.stamps_s[200 + i] += 0.05;
  const EgoResult r = evaluate(drive(300, 10), estimate);
  EXPECT_THAT(r.warnings, Contains(code("unmatched")));
  EXPECT_THAT(r.warnings, Contains(code("coverage")));
  EXPECT_EQ(r.errors.size(), 200);
}

TEST(EgoEvaluation, AConstantLagIsFoundWithItsSignAndSize) {
  // The estimate's poses carry stamps 0.3 s too late: at stamp t it is where the truth was at t - 0.3.
  for (const double lag_s : {0.3, -0.5}) {
    const EgoResult r = evaluate(drive(600, 10), noisy(drive(600, 10, -lag_s)));
    EXPECT_THAT(r.warnings, Contains(code("lag")));
    const auto lag = estimate_lag(drive(600, 10), drive(600, 10).stamps_s, noisy(drive(600, 10, -lag_s)),
                                  drive(600, 10).stamps_s);
    ASSERT_TRUE(lag);
    EXPECT_NEAR(lag->lag, lag_s, 0.051);
  }
  EgoOptions repaired;
  repaired.association.offset_s = -0.3;
  const EgoResult r = evaluate(drive(600, 10), noisy(drive(600, 10, -0.3)), repaired);
  EXPECT_LT(r.statistics.rmse, 0.02);
  EXPECT_THAT(r.warnings, Not(Contains(code("lag"))));
}

TEST(EgoEvaluation, AShortLagOfASmoothDriveIsFound) {
  for (const double lag_s : {0.1, -0.06, 0.8}) {
    const PoseSeries truth = drive(2000, 50), late = noisy(drive(2000, 50, -lag_s));
    const auto lag = estimate_lag(truth, truth.stamps_s, late, late.stamps_s);
    ASSERT_TRUE(lag) << lag_s;
    EXPECT_NEAR(lag->lag, lag_s, 0.011);
  }
  const PoseSeries truth = drive(2000, 50), same = noisy(drive(2000, 50));
  EXPECT_FALSE(estimate_lag(truth, truth.stamps_s, same, same.stamps_s));
}

TEST(EgoEvaluation, AShiftBelowAStepIsReportedWhenItExplainsTheError) {
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

TEST(EgoEvaluation, AShiftOfRowsIsFoundAmongErrorsThatAreIndependentFromPoseToPose) {
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

TEST(EgoEvaluation, TruthThatJumpsToTheIdentityIsAnErrorThatSaysSo) {
  PoseSeries poses = drive(100, 10);
  poses.stamps_s.clear();
  for (Eigen::Vector3d& p : poses.positions_m) p[0] += 300;
  poses.positions_m[40].setZero();
  poses.rotations[40].setIdentity();
  try {
    check_physical(poses, "a.txt", 100);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(std::string(error.what()), HasSubstr("logged as identity"));
  }
}

TEST(EgoEvaluation, WhatAShiftOfTheClockWouldExplainAsWellIsNotReportedAsOne) {
  PoseSeries longer = noisy(drive(300, 10, 0, 1.02)), beside = noisy(drive(300, 10));
  for (size_t i = 0; i < beside.size(); ++i)
    beside.positions_m[i] += beside.rotations[i] * Eigen::Vector3d(0, 0, 0.5);
  for (const Alignment how : {Alignment::none, Alignment::origin, Alignment::se3}) {
    EXPECT_THAT(evaluate(drive(300, 10), longer, {.alignment = how}).warnings, Not(Contains(code("lag"))));
    EXPECT_THAT(evaluate(drive(300, 10), beside, {.alignment = how}).warnings,
                ElementsAre(code("lever_arm")));
  }
}

TEST(EgoEvaluation, ALostTrackerThatRepeatsItsPose) {
  PoseSeries estimate = noisy(drive(300, 10));
  for (size_t i = 150; i < 160; ++i) {
    estimate.positions_m[i] = estimate.positions_m[149];
    estimate.rotations[i] = estimate.rotations[149];
  }
  EXPECT_THAT(evaluate(drive(300, 10), estimate).warnings,
              Contains(text("repeats its last pose exactly 10 times")));
}

TEST(EgoEvaluation, LostFramesThatAreWrittenAsIdentityAreNamed) {
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

TEST(EgoEvaluation, AnEstimateThatStandsAtItsOriginHasLostNoPose) {
  PoseSeries reference = drive(300, 10), estimate = noisy(drive(300, 10));
  for (size_t i = 0; i < 40; ++i) {
    for (PoseSeries* s : {&reference, &estimate}) {
      s->positions_m[i] = {s == &estimate && i % 5 == 4 ? 0.001 : 0, 0, 0};  // written with three digits
      s->rotations[i].setIdentity();
    }
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("lost_poses"))));
}

TEST(EgoEvaluation, ATrackerThatStartsAgainElsewhereIsReportedWithThePlace) {
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

TEST(EgoEvaluation, GapsDriftAndAnotherScaleAreNoJumps) {
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

TEST(EgoEvaluation, AStandstillIsNoLostTracker) {
  PoseSeries reference = drive(300, 10), estimate = noisy(drive(300, 10));
  for (size_t i = 150; i < 200; ++i) {
    for (PoseSeries* s : {&reference, &estimate}) {
      s->positions_m[i] = s->positions_m[149];
      s->rotations[i] = s->rotations[149];
    }
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("repeated_poses"))));
}

TEST(EgoEvaluation, IdentityTruthAndTheSameFileTwice) {
  PoseSeries reference = drive(300, 10);
  reference.positions_m[20].setZero();
  reference.rotations[20].setIdentity();
  EXPECT_THAT(evaluate(reference, noisy(drive(300, 10))).warnings, Contains(code("identity")));
  EXPECT_THAT(evaluate(drive(300, 10), drive(300, 10)).warnings, Contains(code("identical")));
}

TEST(EgoEvaluation, StandingAtTheOriginFirstIsNoMissingTruth) {
  PoseSeries reference = drive(300, 10), estimate = noisy(drive(300, 10));
  for (size_t i = 0; i < 40; ++i) {
    reference.positions_m[i].setZero();
    reference.rotations[i].setIdentity();
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Contains(code("identity"))) << "the estimate moves";
  for (size_t i = 0; i < 40; ++i) estimate.positions_m[i] = {0.01 * static_cast<double>(i % 3), 0, 0};
  EXPECT_THAT(evaluate(reference, estimate).warnings, Not(Contains(code("identity"))));
}

TEST(EgoEvaluation, ALineLeavesARotationOpen) {
  PoseSeries line;
  for (int i = 0; i < 50; ++i) {
    line.add(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.3 * i, 0.1 * i, 0.7 * i + (i == 20 ? 1e-6 : 0)));
    line.frames.push_back(i);
  }
  EXPECT_THAT(evaluate(line, line, {.alignment = Alignment::se3}).warnings, Contains(code("line")));
}

TEST(EgoEvaluation, ANearlyStraightPathLeavesErrorsOfRotationUncertain) {
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
  const EgoOptions relative{.alignment = Alignment::se3, .relation = angle_deg, .rpe = PairSelection{}};
  EXPECT_THAT(warnings(0.005, relative), IsEmpty()) << "a common rotation leaves relative errors unchanged";
}

TEST(EgoEvaluation, WhatCannotBeMatchedIsAnError) {
  PoseSeries far = drive(50, 10);
  for (double& t : far.stamps_s) t += 1000;
  expect_error([&] { evaluate(drive(50, 10), far); }, "no pose matches");
  PoseSeries rows = drive(50, 10), fewer = drive(49, 10);
  rows.stamps_s.clear();
  expect_error([&] { evaluate(rows, fewer); }, "only one of reference and estimate has time stamps");
  fewer.stamps_s.clear();
  expect_error([&] { evaluate(rows, fewer); }, "has 49 poses, the reference 50");
}

TEST(EgoEvaluation, RowsThatAreTakenAsFramesAreReported) {
  PoseSeries reference = drive(60, 10), estimate = noisy(drive(60, 10));
  reference.stamps_s.clear();
  estimate.stamps_s.clear();
  for (int i = 0; i < 60; ++i) reference.frames.push_back(i);
  EXPECT_THAT(evaluate(reference, estimate).warnings, IsEmpty());
  for (int& frame : reference.frames) frame += 20;
  EXPECT_THAT(evaluate(reference, estimate).warnings, Contains(code("rows")));
}

TEST(EgoEvaluation, RowsWithStampsThatAreNotTheFramesAreAnError) {
  PoseSeries whole = drive(144, 10), numbered = noisy(drive(144, 10));
  numbered.stamps_s.clear();
  for (int i = 0; i < 144; ++i) numbered.frames.push_back(i);
  std::vector<int> gap, second;
  for (int i = 0; i < 144; ++i) {
    if (i < 20 || i >= 25) gap.push_back(i);
    if (i % 2 == 0) second.push_back(i);
  }
  EXPECT_THAT(evaluate(whole, numbered).warnings, IsEmpty()) << "row k is frame k";
  PoseSeries fewer = numbered, jittering = whole;
  fewer.keep(gap);
  EXPECT_THAT(evaluate(whole, fewer).warnings, IsEmpty()) << "frames that the estimate lost";
  for (size_t i = 0; i < jittering.size(); i += 3) jittering.stamps_s[i] += 0.03;
  EXPECT_EQ(evaluate(jittering, numbered).errors.size(), 144);
  for (const bool swapped : {false, true}) {
    for (const auto& [rows, why] :
         {std::pair(&gap, "between rows 20 and 21 its stamps differ by 0.6 s"),
          std::pair(&second, "it has 72 rows, but the frame numbers are 0 to 143")}) {
      PoseSeries stamped = whole;
      stamped.keep(*rows);
      const auto run = [&] { swapped ? evaluate(numbered, stamped) : evaluate(stamped, numbered); };
      expect_error(run, why);
      expect_error(run, rows == &gap ? "the median rate of the stamps is 10 Hz"
                                     : "the median rate of the stamps is 5 Hz, over 14.2 s");
    }
  }
}

TEST(EgoEvaluation, StampsThatAreNoSecondsAreReported) {
  PoseSeries reference = drive(60, 10), estimate = noisy(drive(60, 10));
  for (PoseSeries* s : {&reference, &estimate}) {
    for (double& t : s->stamps_s) t *= 1e9;
  }
  EXPECT_THAT(evaluate(reference, estimate).warnings, Contains(code("clock")));
}

TEST(EgoEvaluation, AnInterpolatedReferenceIsAtTheEstimatesTimes) {
  // The reference at 10 Hz, the estimate in between at 25 Hz: nearest poses are 9 cm off.
  PoseSeries estimate = drive(600, 25, 0.013);
  for (double& t : estimate.stamps_s) t += 0.013;
  EgoOptions nearest;
  nearest.association.max_difference_s = 0.06;
  EXPECT_GT(evaluate(drive(300, 10), estimate, nearest).statistics.rmse, 0.05);
  EgoOptions options{.interpolate_max_gap_s = 0.11};
  const EgoResult r = evaluate(drive(300, 10), estimate, options);
  EXPECT_LT(r.statistics.rmse, 0.02);
  EXPECT_EQ(r.errors.size(), 600 - r.interpolation->n_outside);
  EXPECT_NEAR(r.interpolation->largest_gap_s, 0.1, 1e-9);
  EXPECT_EQ(r.reference_rows[1], 1) << "0.053 s: the pose at 0.1 s is nearer than that at 0";
  EXPECT_EQ(r.reference_rows[0], 0);
  options.interpolate_max_gap_s = 0.05;
  expect_error([&] { evaluate(drive(300, 10), estimate, options); }, "--interpolate 0.05 s");
  options.interpolate_max_gap_s = 0.11;
  options.association.start_s = 105;
  options.association.end_s = 110;
  EXPECT_EQ(evaluate(drive(300, 10), estimate, options).errors.size(), 125);
  estimate.stamps_s.clear();
  expect_error([&] { evaluate(drive(300, 10), estimate, options); }, "--interpolate needs time stamps");
}

TEST(EgoEvaluation, AnOffsetIsEstimatedWithItsInterval) {
  for (const double late_s : {0.3, -0.047}) {
    EgoOptions options{.interpolate_max_gap_s = 0.2, .estimate_offset = true};
    const EgoResult r = evaluate(drive(600, 10), noisy(drive(600, 10, -late_s)), options);
    EXPECT_NEAR(r.offset->offset_s, -late_s, 0.002);
    EXPECT_LE(r.offset->low_s, r.offset->offset_s);
    EXPECT_LT(r.offset->high_s - r.offset->low_s, 0.02);
    EXPECT_LT(r.statistics.rmse, 0.05);
    EXPECT_THAT(r.warnings, IsEmpty());
  }
}

TEST(EgoEvaluation, AnOffsetAroundAnEpochIsEstimatedAsWell) {
  constexpr double epoch_s = 1.4e9;
  PoseSeries estimate = noisy(drive(600, 10, 0.03));
  for (double& t : estimate.stamps_s) t += epoch_s;
  EgoOptions options{.interpolate_max_gap_s = 0.2};
  options.association.offset_s = -epoch_s;
  const EgoResult reported = evaluate(drive(600, 10), estimate, options);
  ASSERT_THAT(reported.warnings, ElementsAre(code("lag")));
  EXPECT_THAT(reported.warnings, Contains(text("--offset -1399999999.97")));
  options.estimate_offset = true;
  const EgoResult r = evaluate(drive(600, 10), estimate, options);
  EXPECT_NEAR(r.offset->offset_s, 0.03 - epoch_s, 0.002);
  EXPECT_LT(r.offset->high_s - r.offset->low_s, 0.02);
}

TEST(EgoEvaluation, WhatDoesNotDetermineAnOffsetIsAnError) {
  PoseSeries steady;
  for (int i = 0; i < 200; ++i) {
    steady.add(Eigen::Matrix3d::Identity(), {0, 0, 0.5 * i});
    steady.stamps_s.push_back(0.1 * i);
  }
  const EgoOptions options{.estimate_offset = true};
  expect_error([&] { evaluate(steady, noisy(steady), options); }, "do not determine a time offset");
  expect_error([&] { evaluate(drive(30, 10), drive(30, 10), options); }, "40 needed");
  PoseSeries other = drive(300, 10);  // a different motion
  std::mt19937_64 random(3);
  for (size_t i = 1; i < other.size(); ++i)
    other.positions_m[i] =
        other.positions_m[i - 1] + Eigen::Vector3d(0, 0, 0.1 * static_cast<double>(random() % 10));
  for (Eigen::Matrix3d& R : other.rotations) R.setIdentity();
  expect_error([&] { evaluate(drive(300, 10), other, options); }, "do not determine a time offset");
  PoseSeries rows = drive(300, 10);
  rows.stamps_s.clear();
  expect_error([&] { evaluate(rows, rows, options); }, "needs time stamps");
}

TEST(EgoEvaluation, ATimeRangeLeavesOutTheRestOfTheReference) {
  EgoOptions options;
  options.association.start_s = 105;
  options.association.end_s = 110;
  const EgoResult r = evaluate(drive(300, 10), noisy(drive(300, 10)), options);
  EXPECT_EQ(r.errors.size(), 51);
  EXPECT_EQ(r.reference_rows.front(), 50);
}

TEST(EgoEvaluation, PairsWithoutDistanceHaveNoRatio) {
  PoseSeries reference = drive(50, 10);
  for (size_t k = 20; k < 24; ++k) reference.positions_m[k] = reference.positions_m[19];
  EgoOptions options;
  options.rpe = PairSelection{};
  options.relation = PoseRelation::point_distance_error_ratio;
  TrajectoryFile file;
  file.poses = drive(50, 10);
  const EgoResult r = evaluate_ego(reference_of(reference), file, "est.tum", options);
  EXPECT_EQ(r.pairs.size(), 45);
  EXPECT_EQ(r.errors.size(), 45);
  EXPECT_TRUE(std::ranges::any_of(r.warnings, [](const auto& w) { return w.code == "still_pairs"; }));
  for (Eigen::Vector3d& p : reference.positions_m) p.setZero();
  EXPECT_THROW(evaluate_ego(reference_of(reference), file, "est.tum", options), Error);
}

TEST(EgoEvaluation, PerFrameErrorsSkipGaps) {
  PoseSeries reference = drive(20, 10), estimate = noisy(drive(20, 10));
  reference.stamps_s.clear();
  estimate.stamps_s.clear();
  for (int i = 0; i < 20; ++i) {
    reference.frames.push_back(i);
    estimate.frames.push_back(i);
  }
  const std::vector<int> kept = {0, 1, 2, 5, 6};
  estimate.keep(kept);
  EXPECT_EQ(evaluate(reference, estimate).per_frame.row, (std::vector<int>{1, 2, 6}));
  EXPECT_EQ(evaluate(reference, estimate).per_frame.n_left_out, 1);
}

TEST(EgoEvaluation, PerFrameErrorsSkipGapsInTime) {
  PoseSeries estimate = noisy(drive(300, 10));
  std::vector<int> kept;
  for (int i = 0; i < 300; ++i)
    if (i < 100 || i >= 150) kept.push_back(i);
  estimate.keep(kept);
  const EgoReference reference = reference_of(drive(300, 10));
  TrajectoryFile file;
  file.poses = estimate;
  const EgoResult r = evaluate_ego(reference, file, "b.txt", {});
  EXPECT_EQ(r.per_frame.row.size(), 248);
  EXPECT_EQ(r.per_frame.n_left_out, 1);
  EXPECT_FALSE(std::ranges::count(r.per_frame.row, 150)) << "a step of 5 s";
  EXPECT_THAT(ego_error_table({r}, reference, {}, true).notes,
              Contains(testing::HasSubstr("E_t and E_R leave out 1 of 249 steps")));
}

TEST(RunStatistics, PoolsErrorsAndComparesSystems) {
  std::vector<EgoResult> runs;
  for (int i = 0; i < 10; ++i) {
    PoseSeries estimate = drive(300, 10);
    const double amplitude = (i < 5 ? 0.1 : 0.2) * (1 + 0.1 * (i % 5));
    for (size_t k = 0; k < estimate.size(); ++k)
      estimate.positions_m[k][0] += amplitude * (1.5 + std::sin(37.0 * static_cast<double>(k)));
    runs.push_back(evaluate(drive(300, 10), estimate));
    runs.back().system = i < 5 ? "good" : "bad";
  }
  const std::vector<SystemSummary> systems = summarize_systems(run_errors(runs));
  ASSERT_EQ(systems.size(), 2);
  double sse = 0;
  for (int i = 0; i < 5; ++i) sse += runs[static_cast<size_t>(i)].statistics.sse;
  EXPECT_NEAR(systems[0].pooled.rmse, std::sqrt(sse / 1500), 1e-12);
  EXPECT_EQ(systems[0].n_errors, 1500);
  ASSERT_TRUE(systems[0].rmse_interval);
  EXPECT_LT(systems[0].rmse_interval->low, systems[0].pooled.rmse);
  EXPECT_GT(systems[0].rmse_interval->high, systems[0].pooled.rmse);

  const std::vector<SystemComparison> comparisons = compare_systems(run_errors(runs), IndependentUnit::runs);
  ASSERT_EQ(comparisons.size(), 1);
  EXPECT_NEAR(comparisons[0].difference, -0.18, 0.002);  // 0.12 * 1.5 - 0.24 * 1.5
  EXPECT_DOUBLE_EQ(comparisons[0].p_corrected.value(), smallest_p_of_runs(5, 5))
      << "every good run is better";
  EXPECT_LT(compare_systems(run_errors(runs), IndependentUnit::blocks)[0].p_corrected.value(), 0.001);
  EXPECT_FALSE(summarize_systems(run_errors({runs.begin(), runs.begin() + 4}))[0].rmse_interval)
      << "four runs are too few to estimate their spread";

  const EgoReference reference = reference_of(drive(300, 10));
  EXPECT_DOUBLE_EQ(ego_json(runs, reference, {})["comparisons"][0]["p"].get<double>(), 2. / 252);
  EXPECT_THAT(to_text(ego_comparison_table(runs, {})), HasSubstr("that 5 and 5 runs can give is 0.0079"));
  runs[3] = runs[0];
  runs[3].system = "same";
  runs.resize(4);
  const Json comparison = ego_json(runs, reference, {})["comparisons"];
  ASSERT_EQ(comparison.size(), 1);
  EXPECT_FALSE(comparison[0].contains("p")) << "3 runs and 1 run";
  EXPECT_EQ(comparison[0]["why_no_p"],
            "errors along one path depend on each other: give several runs of each system");
  EXPECT_THAT(to_text(ego_comparison_table(runs, {})), HasSubstr("No p of good and same: errors along one"));
  EgoOptions relative;
  relative.rpe = PairSelection{};
  EXPECT_TRUE(ego_json(runs, reference, relative)["comparisons"][0].contains("p"));
}

/// Share of 200 comparisons of systems that err alike in which p is below 5 %. `run_of(random, system)` makes
/// one run.
template <typename RunOf>
double share_of_false_alarms(int n_runs, IndependentUnit unit, RunOf run_of) {
  constexpr int n_trials = 200;
  int n_significant = 0;
  for (int trial = 0; trial < n_trials; ++trial) {
    std::mt19937_64 random(static_cast<uint64_t>(trial));
    std::vector<RunErrors> runs;
    for (const char* system : {"a", "b"}) {
      for (int i = 0; i < n_runs; ++i) runs.push_back(run_of(random, system));
    }
    n_significant += compare_systems(runs, unit).at(0).p.value() < 0.05;
  }
  return static_cast<double>(n_significant) / n_trials;
}

TEST(RunStatistics, RandomWalksOfTheSameLawAreRarelyCalledDifferent) {
  const auto walk = [](std::mt19937_64& random, const char* system) {
    std::normal_distribution<double> step(0, 0.1);
    RunErrors run{system, "", {}, {}};
    double offset = 0;
    for (int row = 0; row < 200; ++row) {
      offset += step(random);
      run.errors.push_back(std::abs(offset));
      run.steps.emplace_back(0, row);
    }
    return run;
  };
  EXPECT_LT(share_of_false_alarms(6, IndependentUnit::runs, walk), 0.08);
  EXPECT_GT(share_of_false_alarms(6, IndependentUnit::blocks, walk), 0.3)
      << "blocks of one path are not independent";
}

TEST(RunStatistics, ObjectsSeenByOneCameraAreNotIndependent) {
  const auto seen_together = [](std::mt19937_64& random, const char* system) {
    std::normal_distribution<double> normal(0, 1);
    RunErrors run{system, "", {}, {}};
    for (int frame = 0; frame < 60; ++frame) {
      const double of_camera = normal(random);
      for (int object = 1; object <= 10; ++object) {
        run.errors.push_back(5 + of_camera + normal(random));
        run.steps.emplace_back(object, frame);
      }
    }
    return run;
  };
  EXPECT_LT(share_of_false_alarms(1, IndependentUnit::blocks, seen_together), 0.08);
}

TEST(RunStatistics, NoPWhereNoOutcomeCouldBeSignificant) {
  std::vector<RunErrors> runs;
  for (int i = 0; i < 6; ++i) {
    RunErrors run{i < 3 ? "a" : "b", "", {}, {}};
    for (int row = 0; row < 6; ++row) {
      run.errors.push_back(i + 0.1 * row);
      run.steps.emplace_back(row % 2, row / 2);
    }
    runs.push_back(std::move(run));
  }
  const SystemComparison of_runs = compare_systems(runs, IndependentUnit::runs).at(0);
  EXPECT_FALSE(of_runs.p);
  EXPECT_THAT(of_runs.why_no_p, HasSubstr("smallest p that 3 and 3 runs can give is 0.10"));
  const SystemComparison of_blocks = compare_systems(runs, IndependentUnit::blocks).at(0);
  EXPECT_FALSE(of_blocks.p) << "six steps, but of three frames";
  EXPECT_THAT(of_blocks.why_no_p, HasSubstr("6 frames"));
}

}  // namespace
}  // namespace sextant
