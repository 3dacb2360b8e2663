#include "sextant/eval/report/noise_tables.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sextant/stats/trend.h"

namespace sextant {
namespace {

Record record_of(uint64_t seed, double Et_m, double bound_m, double nees) {
  Record r;
  r.seed = seed;
  r.errors = {{"Et_m", Et_m}, {"ER_deg", 0.1}};
  r.bound = {{"Et_m", bound_m}, {"ER_deg", 0.05}};
  r.body = "ego";
  r.values = {{"nees", nees}, {"step_gt_m", 1}};
  return r;
}

std::vector<const Record*> pointers(const std::vector<Record>& records) {
  std::vector<const Record*> out;
  for (const Record& record : records) out.push_back(&record);
  return out;
}

TEST(LimitSummary, ByHand) {
  std::vector<Record> records;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    records.push_back(record_of(seed, 1, 3, 5));
    records.push_back(record_of(seed, 7, 4, 8));
  }
  records.push_back(record_of(3, 100, 1, 6.5));
  records.back().bound.clear();  // an error without a bound does not count against one
  const LimitSummary limit = summarize_limit(level_of(pointers(records)), {});
  EXPECT_DOUBLE_EQ(limit.efficiency.at("Et_m").bound, std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(limit.efficiency.at("Et_m").efficiency, std::sqrt(12.5 / 25));
  // Every seed has the same RMS.
  EXPECT_DOUBLE_EQ(limit.efficiency.at("Et_m").interval->low, limit.efficiency.at("Et_m").efficiency);
  EXPECT_DOUBLE_EQ(limit.efficiency.at("Et_m").interval->high, limit.efficiency.at("Et_m").efficiency);
  EXPECT_NEAR(limit.efficiency.at("ER_deg").efficiency, 0.5, 1e-12);
  EXPECT_NEAR(limit.consistency->anees, 6.5, 1e-12);
  EXPECT_EQ(limit.consistency->n, 21);
  EXPECT_EQ(limit.consistency->expected.high, nees_interval(21, 6).high);
}

TEST(LimitSummary, TheIntervalOfTheEfficiencyIsTheRightWayRound) {
  std::vector<Record> records;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    records.push_back(record_of(seed, 1 + 0.1 * static_cast<double>(seed), 1, 6));
  }
  const Efficiency value = summarize_limit(level_of(pointers(records)), {}).efficiency.at("Et_m");
  EXPECT_LT(value.interval->low, value.efficiency);
  EXPECT_GT(value.interval->high, value.efficiency);
}

TEST(LimitSummary, IsEmptyIfNothingIsKnown) {
  Record r;
  r.errors = {{"Et_m", 1}};
  const LimitSummary limit = summarize_limit(level_of({&r}), {});
  EXPECT_TRUE(limit.efficiency.empty());
  EXPECT_FALSE(limit.consistency);
  for (const Field<LimitSummary>& field : limit_fields())
    EXPECT_TRUE(field.of(limit).is_empty()) << field.column.key;
}

}  // namespace
}  // namespace sextant
