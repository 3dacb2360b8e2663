#include "sextant/eval/benchmark/card.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

using Levels = std::map<double, NoiseLevel>;

void add(uint64_t seed, int frame, std::optional<double> error, NoiseLevel& level) {
  Record record;
  record.body = "ego";
  record.seed = seed;
  record.frame = frame;
  record.values = {{"step_gt_m", 1.0}};
  record.status = error ? Status::ok : Status::lost;
  if (error) record.errors = {{"Et_m", *error}};
  level.add(record);
}

/// One level: `errors` of the frames 1, 2, .. of every seed, alike for all seeds but for a small spread.
NoiseLevel level_of(const std::vector<std::optional<double>>& errors, int n_seeds = 6) {
  NoiseLevel level(NoiseLevelKey{});
  for (int seed = 0; seed < n_seeds; ++seed) {
    for (size_t i = 0; i < errors.size(); ++i) {
      auto error = errors[i];
      if (error) *error *= 1 + 0.01 * (seed - 2.5);
      add(static_cast<uint64_t>(seed), static_cast<int>(i) + 1, error, level);
    }
  }
  return level;
}

BreakdownLevel breakdown_of(const Levels& levels, double nominal) {
  return sextant::breakdown_of(levels, compared_error("Et_m"), nominal, 2, 0.9);
}

TEST(Breakdown, IsInterpolatedBetweenLevels) {
  const Levels levels = {{0.1, level_of({1, 1})},
                         {0.2, level_of({1, 1})},
                         {0.4, level_of({1.5, 1.5})},
                         {0.8, level_of({2.5, 2.5})}};
  const BreakdownLevel found = breakdown_of(levels, 0.2);
  EXPECT_EQ(found.cause, BreakdownCause::error);
  EXPECT_NEAR(found.level, 0.6, 1e-12);
  ASSERT_TRUE(found.interval);
  EXPECT_NEAR(found.interval->low, 0.6, 1e-9);  // the spread is the same at all levels: it cancels
  EXPECT_EQ(found.text(), "0.6");
}

TEST(Breakdown, LevelsBelowTheNominalOneDoNotCount) {
  const Levels levels = {{0.1, level_of({100, 100})}, {0.2, level_of({1, 1})}, {0.4, level_of({1.1, 1.1})}};
  EXPECT_EQ(breakdown_of(levels, 0.2).text(), "> 0.4");
}

TEST(Breakdown, LostCoverageBreaksDownBeforeTheError) {
  std::vector<std::optional<double>> some(10, 1.0), half(10, 1.0);
  for (size_t i = 0; i < 5; ++i) half[i].reset();
  const BreakdownLevel found = breakdown_of({{1, level_of(some)}, {2, level_of(half)}}, 1);
  EXPECT_EQ(found.cause, BreakdownCause::coverage);
  EXPECT_NEAR(found.level, 1.2, 1e-12);  // from 100 % at 1 to 50 % at 2
}

TEST(Breakdown, NothingEstimatedAtTheNominalLevelIsAtNominal) {
  const BreakdownLevel found = breakdown_of({{1, level_of({std::nullopt, 1.0})}, {2, level_of({1, 1})}}, 1);
  EXPECT_EQ(found.cause, BreakdownCause::nominal);
  EXPECT_EQ(found.text(), "at nominal");
}

TEST(Breakdown, NothingEstimatedBreaksDownWithoutARequiredCoverageToo) {
  const Levels levels = {
      {1, level_of({1, 1})}, {2, level_of({std::nullopt, std::nullopt})}, {3, level_of({9, 9})}};
  const BreakdownLevel found =
      sextant::breakdown_of(levels, compared_error("Et_m"), 1, 2, /*min_coverage=*/0);
  EXPECT_EQ(found.cause, BreakdownCause::coverage);
  EXPECT_EQ(found.level, 2);
}

TEST(Breakdown, IntervalCoversSeedsThatDiffer) {
  NoiseLevel nominal(NoiseLevelKey{}), high(NoiseLevelKey{});
  for (uint64_t seed = 0; seed < 8; ++seed) {
    add(seed, 1, 1.0, nominal);
    add(seed, 1, seed % 2 == 0 ? 2.5 : 3.5, high);
  }
  const BreakdownLevel found = breakdown_of({{1, nominal}, {2, high}}, 1);
  EXPECT_NEAR(found.level, 1.5, 1e-12);
  ASSERT_TRUE(found.interval);
  EXPECT_LT(found.interval->low, 1.49);
  EXPECT_GT(found.interval->high, 1.51);
}

}  // namespace
}  // namespace sextant
