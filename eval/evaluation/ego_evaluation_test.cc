#include "sextant/eval/evaluation/ego_evaluation.h"

#include <cmath>
#include <random>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/ego_drive_testing.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/ego_report.h"

namespace sextant {
namespace {

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
  options.rpe_lengths = {PairSelection{}};
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

TEST(EgoEvaluation, PairsOverMissingPosesAreNamedAndComparedWithEqualOnes) {
  const PoseSeries all = noisy(drive(60, 10));
  PoseSeries some = all;
  std::vector<int> kept;
  for (int i = 0; i < 60; ++i)
    if (i % 7 != 3) kept.push_back(i);
  some.keep(kept);
  EgoOptions options;
  options.rpe_lengths = {PairSelection{}};
  const auto run = [&](const PoseSeries& poses, const char* name) {
    TrajectoryFile file;
    file.poses = poses;
    return evaluate_ego(reference_of(drive(60, 10)), file, name, options);
  };
  const std::vector<EgoResult> runs = {run(all, "all"), run(some, "some")};
  const auto is_named = [](const EgoResult& r) {
    return std::ranges::any_of(r.warnings, [](const auto& w) { return w.code == "longer_pairs"; });
  };
  EXPECT_FALSE(is_named(runs[0]));
  EXPECT_TRUE(is_named(runs[1]));
  const SystemComparison c = compare_systems(run_errors(runs), IndependentUnit::blocks).at(0);
  EXPECT_EQ(c.n_common, 59U - 17);  // poses 3, 10, .., 59 are missing; the last one has one pair
  EXPECT_EQ(c.difference, 0);
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

}  // namespace
}  // namespace sextant
