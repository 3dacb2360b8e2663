#include "sextant/eval/evaluation/trajectory_offset.h"

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/ego_drive_testing.h"

namespace sextant {
namespace {

using testing::Contains;
using testing::Not;

struct Counts {
  int n = 0, answered = 0, missed = 0;
};

/// Counts the intervals that do not contain the planted offset, for paths of a duration.
template <typename PathOf>
Counts coverage(double duration_s, double rate_hz, const PathOf& path_of) {
  Counts counts;
  for (int seed = 0; seed < 4; ++seed) {
    const PoseSeries truth = path_of(static_cast<int>(duration_s * rate_hz), rate_hz, 1.3 * seed);
    for (const double offset_s : {0.0, 0.3, -0.3}) {
      PoseSeries estimate = with_step_errors(truth, static_cast<unsigned>(seed));
      for (double& t : estimate.stamps_s) t -= offset_s;
      ++counts.n;
      try {
        const OffsetEstimate found = estimate_offset(truth, estimate, 0, "odometry");
        ++counts.answered;
        counts.missed += found.low_s > offset_s || offset_s > found.high_s;
      } catch (const Error&) {  // the motion is too uniform
      }
    }
  }
  return counts;
}

TEST(TrajectoryOffset, IntervalsOfUniformMotionContainTheTruth) {
  for (const double rate_hz : {10.0, 100.0}) {
    int missed = 0;
    for (const double duration_s : {4.0, 10.0, 30.0}) {
      const Counts of_car = coverage(duration_s, rate_hz, car),
                   of_stops = coverage(duration_s, rate_hz, stop_and_go);
      missed += of_car.missed + of_stops.missed;
      if (duration_s == 30) {
        EXPECT_EQ(of_car.answered, of_car.n);
      }
    }
    EXPECT_LE(missed, 3) << "of at most 72, at " << rate_hz << " Hz";
  }
}

TEST(TrajectoryOffset, VariedMotionGivesAnAnswer) {
  const Counts counts = coverage(10, 30, [](int n, double rate_hz, double phase) {
    PoseSeries path = drive(n, rate_hz, 10 * phase);
    for (size_t i = 0; i < path.size(); ++i) path.stamps_s[i] = 100 + static_cast<double>(i) / rate_hz;
    return path;
  });
  EXPECT_EQ(counts.answered, counts.n);
  EXPECT_LE(counts.missed, 1);
}

TEST(TrajectoryOffset, NothingIsComparedWithinAGap) {
  constexpr double gap_s = 1000;
  const auto with_gap = [](PoseSeries s) {
    for (size_t i = s.size() / 2; i < s.size(); ++i) s.stamps_s[i] += gap_s;
    return s;
  };
  const PoseSeries few = with_gap(car(60, 10, 0.5));
  expect_error([&] { estimate_offset(few, with_step_errors(few, 1), 0, "few"); }, "40 needed");
  for (const double offset_s : {0.0, 0.3}) {
    const PoseSeries truth = with_gap(drive(400, 10));
    PoseSeries estimate = with_step_errors(truth, 2);
    for (double& t : estimate.stamps_s) t -= offset_s;
    const OffsetEstimate found = estimate_offset(truth, estimate, 0, "gap");
    EXPECT_LE(found.low_s, offset_s);
    EXPECT_GE(found.high_s, offset_s);
    EXPECT_LT(found.high_s - found.low_s, 0.1);
  }
}

TEST(TrajectoryOffset, AGoodEstimateHasNoOtherOffset) {
  for (const double phase : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
    for (const PoseSeries& truth : {car(400, 100, phase), stop_and_go(100, 30, phase)}) {
      if (rms_extent_m(truth) < 1) continue;
      const auto warnings = evaluate(truth, with_step_errors(truth, 3)).warnings;
      EXPECT_THAT(warnings, Not(Contains(code("no_offset")))) << phase;
    }
  }
}

TEST(TrajectoryOffset, AScaleIsNoShiftOfRows) {
  for (int phase = 0; phase < 24; ++phase) {
    const PoseSeries truth = stop_and_go(60, 10, 0.26 * phase);
    const PoseSeries estimate = with_step_errors(truth, static_cast<unsigned>(phase), 0.02, 1.03);
    if (rms_extent_m(truth) < 5) continue;
    for (const Alignment how : {Alignment::none, Alignment::se3}) {
      try {
        EXPECT_THAT(evaluate(truth, estimate, {.alignment = how}).warnings, Not(Contains(code("lag"))))
            << phase;
      } catch (const Error&) {  // a straight line cannot be aligned
      }
    }
  }
}

}  // namespace
}  // namespace sextant
