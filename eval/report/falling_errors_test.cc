#include "sextant/eval/report/trends.h"

#include "sextant/base/testing.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

Record record_at(double level, int frame, std::optional<double> Et_m) {
  Record record;
  record.dataset = "synthetic";
  record.sequence = "s18";
  record.body = "object:2";
  record.estimator = "own";
  record.noise = "flow";
  record.level = level;
  record.frame = frame;
  record.values["distance_gt_m"] = 10;  // has truth
  record.status = Et_m ? Status::ok : Status::lost;
  if (Et_m) record.errors["Et_m"] = *Et_m;
  return record;
}

TEST(FallingErrors, LostPairsAreCoverage) {
  std::vector<Record> records;
  for (const int frame : {1, 2}) {
    records.push_back(record_at(1, frame, 0.02));
    records.push_back(record_at(2, frame, 0.03));
  }
  records.push_back(record_at(1, 3, 0.2));
  records.push_back(record_at(2, 3, std::nullopt));
  const std::vector<FallingError> rows = falling_errors({noise_sweep_of("flow.scale", records)});
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_NEAR(rows[0].Et_m.lowest, 0.08, 1e-12);
  EXPECT_NEAR(rows[0].Et_m.highest, 0.03, 1e-12);
  EXPECT_EQ(rows[0].common_Et_m->n, 2U);
  EXPECT_NEAR(rows[0].common_Et_m->lowest, 0.02, 1e-12);
  EXPECT_THAT(rows[0].reason(), testing::StartsWith("coverage"));
}

TEST(FallingErrors, AFallOnTheSamePairsIsSelection) {
  std::vector<Record> records;
  for (const int frame : {1, 2}) {
    records.push_back(record_at(1, frame, 0.2));
    records.push_back(record_at(2, frame, 0.1));
  }
  const std::vector<FallingError> rows = falling_errors({noise_sweep_of("flow.scale", records)});
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_THAT(rows[0].reason(), testing::StartsWith("selection"));
}

TEST(FallingErrors, ErrorsThatRiseAreNotListed) {
  const std::vector<Record> records = {record_at(1, 1, 0.1), record_at(2, 1, 0.2)};
  EXPECT_TRUE(falling_errors({noise_sweep_of("flow.scale", records)}).empty());
}

TEST(FallingErrors, AParameterThatDoesNotIncreaseNoiseIsNotListed) {
  const std::vector<Record> records = {record_at(0.25, 1, 0.2), record_at(2, 1, 0.1)};
  EXPECT_EQ(falling_errors({noise_sweep_of("depth.delta_d_px with flow 1 px", records)}).size(), 1U);
  EXPECT_TRUE(falling_errors({noise_sweep_of("depth.baseline_m with flow 1 px", records)}).empty());
}

}  // namespace
}  // namespace sextant
