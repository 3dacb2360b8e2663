#include "sextant/eval/report/noise_tables.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

Record record_of(const std::string& body, double level, uint64_t seed, double Et_m,
                 Status status = Status::ok) {
  Record r = RecordOf{.body = body, .noise = "depth", .level = level, .seed = seed, .frame = 0};
  r.status = status;
  if (status == Status::ok) r.errors = {{"Et_m", Et_m}, {"ER_deg", 2 * Et_m}};
  return r;
}

TEST(NoiseLevels, MeansAndIntervalsByHand) {
  std::vector<Record> records;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const double spread = seed % 2 == 0 ? 1 : 1.5;  // seeds with the same errors would be copies
    for (const double x : {2 - spread, 2 + spread}) records.push_back(record_of("ego", 0.2, seed, x));
  }
  records.push_back(record_of("ego", 0.1, 0, 5));
  records.push_back(record_of("object:10", 0.1, 0, 1));
  records.push_back(record_of("object:2", 0.1, 0, 1));
  records.push_back(record_of("object:2", 0.1, 0, 0, Status::lost));
  Record parked = record_of("object:3", 0.1, 0, 1);
  parked.values["dynamic_gt"] = 0;
  records.push_back(parked);

  const std::vector<NoiseLevelRow> rows = noise_levels(noise_sweep_of("depth.delta_d_px", records));
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0].level, 0.1);
  EXPECT_FALSE(rows[0].errors.at("Et_m").mean.interval);  // one seed: nothing is known of the spread
  EXPECT_EQ(rows[1].body, "ego");
  EXPECT_EQ(rows[1].n_seeds, 12);
  EXPECT_DOUBLE_EQ(rows[1].errors.at("Et_m").mean.value, 2);
  EXPECT_DOUBLE_EQ(rows[1].errors.at("Et_m").median.value, 2);
  EXPECT_DOUBLE_EQ(rows[1].errors.at("Et_m").rmse.value, std::sqrt(5.625));
  EXPECT_DOUBLE_EQ(rows[1].errors.at("ER_deg").mean.value, 4);
  // Every seed has the same mean, so the interval has no width; with pairs as clusters it would have one.
  EXPECT_DOUBLE_EQ(rows[1].errors.at("Et_m").mean.interval->low, 2);
  EXPECT_DOUBLE_EQ(rows[1].errors.at("Et_m").mean.interval->high, 2);
  EXPECT_EQ(rows[2].body, "object:2");  // before object:10
  EXPECT_EQ(rows[2].n_truth, 2);
  EXPECT_EQ(rows[2].n_estimated, 1);
  EXPECT_EQ(noise_level_table(rows).rows.size(), 4U);
}

}  // namespace
}  // namespace sextant
