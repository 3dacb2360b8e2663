#include "sextant/eval/benchmark/card.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

/// One level: `errors` of the frames 1, 2, .. of every seed, alike for all seeds but for a small spread.
LevelCounts level_of(double level, const std::vector<std::optional<double>>& errors, int n_seeds = 6) {
  LevelCounts counts{level};
  for (int seed = 0; seed < n_seeds; ++seed) {
    for (size_t i = 0; i < errors.size(); ++i) {
      auto error = errors[i];
      if (error) *error *= 1 + 0.01 * (seed - 2.5);
      counts.add(static_cast<uint64_t>(seed), static_cast<int>(i) + 1, error);
    }
  }
  return counts;
}

TEST(Breakdown, IsInterpolatedBetweenLevels) {
  const std::vector<LevelCounts> levels = {level_of(0.1, {1, 1}), level_of(0.2, {1, 1}),
                                           level_of(0.4, {1.5, 1.5}), level_of(0.8, {2.5, 2.5})};
  const BreakdownLevel found = breakdown_of(levels, 0.2, 2, 0.9);
  EXPECT_EQ(found.cause, BreakdownCause::error);
  EXPECT_NEAR(found.level, 0.6, 1e-12);
  ASSERT_TRUE(found.interval);
  EXPECT_NEAR(found.interval->low, 0.6, 1e-9);  // the spread is the same at all levels: it cancels
  EXPECT_EQ(found.text(), "0.6");
}

TEST(Breakdown, LevelsBelowTheNominalOneDoNotCount) {
  const std::vector<LevelCounts> levels = {level_of(0.1, {100, 100}), level_of(0.2, {1, 1}),
                                           level_of(0.4, {1.1, 1.1})};
  EXPECT_EQ(breakdown_of(levels, 0.2, 2, 0.9).text(), "> 0.4");
}

TEST(Breakdown, LostCoverageBreaksDownBeforeTheError) {
  std::vector<std::optional<double>> some(10, 1.0), half(10, 1.0);
  for (size_t i = 0; i < 5; ++i) half[i].reset();
  const BreakdownLevel found = breakdown_of({level_of(1, some), level_of(2, half)}, 1, 2, 0.9);
  EXPECT_EQ(found.cause, BreakdownCause::coverage);
  EXPECT_NEAR(found.level, 1.2, 1e-12);  // from 100 % at 1 to 50 % at 2
}

TEST(Breakdown, NothingEstimatedAtTheNominalLevelIsAtNominal) {
  const BreakdownLevel found =
      breakdown_of({level_of(1, {std::nullopt, 1.0}), level_of(2, {1, 1})}, 1, 2, 0.9);
  EXPECT_EQ(found.cause, BreakdownCause::nominal);
  EXPECT_EQ(found.text(), "at nominal");
}

TEST(Breakdown, IntervalCoversSeedsThatDiffer) {
  LevelCounts nominal{1}, high{2};
  for (uint64_t seed = 0; seed < 8; ++seed) {
    nominal.add(seed, 1, 1.0);
    high.add(seed, 1, seed % 2 == 0 ? 2.5 : 3.5);
  }
  const BreakdownLevel found = breakdown_of({nominal, high}, 1, 2, 0.9);
  EXPECT_NEAR(found.level, 1.5, 1e-12);
  ASSERT_TRUE(found.interval);
  EXPECT_LT(found.interval->low, 1.49);
  EXPECT_GT(found.interval->high, 1.51);
}

}  // namespace
}  // namespace sextant
