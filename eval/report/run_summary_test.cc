#include "sextant/eval/report/run_summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sextant/base/testing.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

Record record_of(int frame, const std::string& body, Status status = Status::ok) {
  Record r = RecordOf{.dataset = "vdo", .body = body, .frame = frame};
  r.values.clear();
  r.status = status;
  return r;
}

/// Ego: two estimated pairs (0.1, 0.3 m) and one lost. Object 2: estimated twice, gated once; once estimated
/// though static by truth. Object 10: no truth.
std::vector<Record> example() {
  std::vector<Record> records;
  for (int frame = 1; frame <= 3; ++frame) {
    Record ego = record_of(frame, "ego", frame == 3 ? Status::too_few_points : Status::ok);
    ego.values["step_gt_m"] = 1;
    if (frame < 3) ego.errors = {{"Et_m", frame == 1 ? 0.1 : 0.3}, {"ER_deg", 0.5}};
    records.push_back(ego);
  }
  for (int frame = 1; frame <= 4; ++frame) {
    Record r = record_of(frame, "object:2", frame == 3 ? Status::gated : Status::ok);
    r.gate = frame == 3 ? Gate::distance : Gate::none;
    r.values = {{"distance_gt_m", 9},
                {"dynamic_gt", frame == 4 ? 0.0 : 1.0},
                {"dynamic", 1},
                {"v_kmh", 40.0 + frame}};
    if (frame != 3) r.errors = {{"Et_m", 0.2 * frame}, {"Et_body_m", 3}, {"Ev_kmh", 2.0 * frame}};
    r.values["v_gt_kmh"] = 50;
    records.push_back(r);
  }
  records.push_back(record_of(1, "object:10", Status::no_truth));
  return records;
}

TEST(Summary, SaysWhatTheTruthIsWorth) {
  std::vector<Record> records = example();
  const size_t n_notes = summary_table(records, find_preset("paper")).notes.size();
  for (Record& record : records) {
    if (record.is_ego()) record.values["step_floor_m"] = 0.0563;
  }
  const std::vector<std::string> notes = summary_table(records, find_preset("paper")).notes;
  ASSERT_EQ(notes.size(), n_notes + 1);
  EXPECT_THAT(notes.back(), testing::AllOf(testing::HasSubstr("vdo s"), testing::HasSubstr("0.0563 m")));
}

TEST(Summary, SaysWhatIsSystematic) {
  std::vector<Record> records = example();
  double x_m = -0.03;
  for (Record& record : records) {
    if (!record.is_ego()) continue;
    record.values["step_error_x_m"] = x_m;
    record.values["step_error_y_m"] = 0.04;
    record.values["step_error_z_m"] = 0;
    x_m -= 0.01;
  }
  const std::vector<std::string> remarks = summary_table(records, find_preset("paper")).remarks;
  ASSERT_EQ(remarks.size(), 1U);
  // Three pairs: -0.03, -0.04, -0.05 m to the right.
  EXPECT_EQ(remarks.back(),
            "Estimated minus true step of ego, vdo s e: mean 0.0566 m (right -0.0400, down 0.0400, "
            "ahead 0.0000), scatter 0.0100, 0.0000, 0.0000 m; the error to the right changes by "
            "-10.00 mm from frame to frame.");
  for (Record& record : records) {  // 0, 0.03 and 0.02 m: may be chance
    if (record.is_ego()) record.values["step_error_x_m"] = record.values["step_error_y_m"] = 0;
    if (record.is_ego()) record.values["step_error_z_m"] = record.frame == 1 ? 0 : 0.05 - 0.01 * record.frame;
  }
  EXPECT_TRUE(summary_table(records, find_preset("paper")).remarks.empty());
}

TEST(Summary, MeansCoverageAndStatusesByHand) {
  const std::vector<BodySummary> rows = summarize(example(), find_preset("paper"));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].body, "ego");
  EXPECT_EQ(rows[0].n_pairs, 3);
  EXPECT_EQ(rows[0].n_truth, 3);
  EXPECT_EQ(rows[0].n_estimated, 2);
  EXPECT_NEAR(rows[0].metrics.at("Et_m"), 0.2, 1e-12);
  EXPECT_FALSE(rows[0].metrics.contains("Ev_kmh"));
  EXPECT_EQ(rows[0].other, "too_few_points 1");

  EXPECT_EQ(rows[1].body, "object:2");
  EXPECT_EQ(rows[1].n_pairs, 4);
  EXPECT_EQ(rows[1].n_truth, 3);  // the pair that is static by truth does not count
  EXPECT_EQ(rows[1].n_estimated, 2);
  EXPECT_NEAR(*rows[1].coverage, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("Et_m"), 0.3, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("Ev_kmh"), 3, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("v_kmh"), 41.5, 1e-12);
  EXPECT_EQ(rows[1].other, "gated(distance) 1");

  EXPECT_EQ(rows[2].body, "object:10");  // after object:2, by number
  EXPECT_FALSE(rows[2].coverage);
  EXPECT_FALSE(rows[2].metrics.contains("Et_m"));
}

TEST(Summary, PresetChoosesKeysAndAggregate) {
  const std::vector<BodySummary> rows = summarize(example(), find_preset("dynosam_rme"));
  EXPECT_NEAR(rows[0].metrics.at("Et_m"), std::sqrt((0.01 + 0.09) / 2), 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("Et_m"), 3, 1e-12);
  EXPECT_FALSE(rows[1].metrics.contains("Ev_kmh"));  // Ev_origin_kmh was not recorded
  const Table table = summary_table(example(), find_preset("dynosam_rme"));
  EXPECT_THAT(table.title, testing::HasSubstr("dynosam_rme (RMSE over pairs)"));
}

TEST(Summary, VdoSlamIsTheMeanWithTheSpeedAtTheCentroid) {
  const std::vector<BodySummary> rows = summarize(example(), find_preset("vdo_slam"));
  EXPECT_NEAR(rows[0].metrics.at("Et_m"), 0.2, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("Et_m"), 3, 1e-12);  // Et_body_m
  EXPECT_NEAR(rows[1].metrics.at("Ev_kmh"), 3, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("v_gt_kmh"), 50, 1e-12);
}

TEST(Summary, SpeedsAreOverThePairsOfTheirError) {
  std::vector<Record> records = example();
  for (Record& r : records) {
    if (r.body != "object:2") continue;
    if (r.frame == 1) r.errors.erase("Ev_kmh");  // the camera's motion was not known
    r.values["v_gt_kmh"] = 50.0 + r.frame;
  }
  const std::vector<BodySummary> rows = summarize(records, find_preset("paper"));
  EXPECT_EQ(rows[1].n_estimated, 2);
  EXPECT_NEAR(rows[1].metrics.at("Et_m"), 0.3, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("Ev_kmh"), 4, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("v_kmh"), 42, 1e-12);
  EXPECT_NEAR(rows[1].metrics.at("v_gt_kmh"), 52, 1e-12);
}

TEST(Summary, ClassificationLeavesOutGatedDetections) {
  const ClassificationCounts counts = count_classification(example());
  EXPECT_EQ(counts.true_positive, 2);
  EXPECT_EQ(counts.false_positive, 1);
  EXPECT_EQ(counts.total(), 3);
}

TEST(Summary, OfNothingIsEmpty) {
  EXPECT_TRUE(summarize({}, find_preset("paper")).empty());
  const Json json = summary_json({}, find_preset("paper"));
  EXPECT_TRUE(json["rows"].empty());
  EXPECT_FALSE(json["classification"].contains("precision"));  // no denominator: not 0
}

TEST(RunSummary, TerminalHasAHundredColumns) {
  std::vector<Record> records;
  for (const char* sequence : {"s18", "a much longer name of a sequence that somebody gave"}) {
    for (const char* body : {"ego", "object:12345"}) {
      Record r = RecordOf{"synthetic", sequence, "joint_flow_depth", body};
      r.errors = {{"Et_m", 0.1}, {"ER_deg", 0.2}, {"Ev_kmh", 123.4}, {"epe_refined_px", 0.5}};
      records.push_back(r);
      r.frame = 2;
      r.status = Status::gated;
      r.gate = Gate::distance;
      records.push_back(r);
    }
  }
  const MetricPreset& preset = find_preset("multimot_code");
  const std::string text = summary_text(records, preset, false);
  for (const std::string& line : split(text, '\n')) EXPECT_LE(line.size(), 100U) << line;
  EXPECT_THAT(text, testing::HasSubstr("object:12345"));
  EXPECT_THAT(text, testing::HasSubstr("E_v [km/h]"));
  EXPECT_EQ(text.find("EPE before"), std::string::npos);
  EXPECT_EQ(summary_text(records, preset, true), to_text(summary_table(records, preset)));
}

TEST(ConsistencyText, IsMeansOfBodiesAndSaysWhatToDoAboutCovariancesThatAreTooSmall) {
  std::vector<Record> records = {record_of(1, "ego"), record_of(2, "ego"), record_of(2, "object:2")};
  const Record without_values = record_of(2, "object:3");
  EXPECT_EQ(consistency_text(records), "");
  for (Record& r : records)
    r.values = {{"split_nees", 6}, {"split_nees_sides", 5}, {"split_nees_cells", 7}, {"nees", 4}};
  records[1].values["split_nees"] = 8;
  records[2].values["expansion_chi2"] = 1.5;
  records.push_back(without_values);
  const std::string good = consistency_text(records);
  EXPECT_THAT(good, HasSubstr("ego"));
  EXPECT_THAT(good, testing::ContainsRegex("ego +2 +7.00 +5.00 +7.00 +4.00 +-\n"));
  EXPECT_THAT(good, testing::ContainsRegex("object:2 +1 +6.00 +5.00 +7.00 +4.00 +1.50\n"));
  EXPECT_THAT(good, Not(HasSubstr("object:3")));
  EXPECT_THAT(good, Not(HasSubstr("too small")));
  records[2].values["split_nees"] = 13;
  EXPECT_THAT(consistency_text(records), HasSubstr("covariances are too small"));
  EXPECT_THAT(consistency_text(records), Not(HasSubstr("disagree")));
  records[2].values["expansion_chi2"] = 4.5;
  EXPECT_THAT(consistency_text(records), HasSubstr("flow and disparities disagree"));
}

}  // namespace
}  // namespace sextant
