#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/report/tables/testing.h"

namespace sextant {
namespace {

size_t column_of(const Table& table, const std::string& key) {
  for (size_t i = 0; i < table.columns.size(); ++i) {
    if (table.columns[i].key == key) return i;
  }
  return table.columns.size();
}

std::string text_at(const Table& table, size_t row, const std::string& key) {
  const Cell& cell = table.rows.at(row).at(column_of(table, key));
  return cell.text() != nullptr ? *cell.text() : "";
}

std::optional<double> number_at(const Table& table, size_t row, const std::string& key) {
  const Cell& cell = table.rows.at(row).at(column_of(table, key));
  return cell.number() != nullptr ? std::optional(*cell.number()) : std::nullopt;
}

class EveryTable : public testing::TestWithParam<PaperTable> {};

TEST_P(EveryTable, SaysSoWhereNothingWasMeasured) {
  Evidence none;
  none.published = paper().published;
  const Table table = GetParam().make(none);
  EXPECT_FALSE(table.rows.empty() && table.notes.empty());
  for (size_t row = 0; row < table.rows.size(); ++row) {
    EXPECT_EQ(text_at(table, row, "verdict"), "not measured here");
    EXPECT_FALSE(number_at(table, row, "reproduced"));
    EXPECT_FALSE(number_at(table, row, "difference"));
  }
}

TEST_P(EveryTable, IsAFunctionOfTheRecords) {
  const std::string all = to_csv(GetParam().make(test_evidence()));
  EXPECT_EQ(all, to_csv(GetParam().make(test_evidence())));
  Evidence fewer = test_evidence();
  for (EvidencePart& part : fewer.parts)
    std::erase_if(part.records, [](const Record& r) { return r.frame > 9; });
  EXPECT_NE(all, to_csv(GetParam().make(fewer)));
}

TEST_P(EveryTable, DifferencesAndVerdictsFollowFromTheirRow) {
  const Table table = GetParam().make(test_evidence());
  if (column_of(table, "verdict") == table.columns.size()) GTEST_SKIP() << "a table without published values";
  size_t n_measured = 0;
  for (size_t row = 0; row < table.rows.size(); ++row) {
    const auto published = number_at(table, row, "published");
    const auto reproduced = number_at(table, row, "reproduced");
    const std::string verdict = text_at(table, row, "verdict");
    EXPECT_EQ(verdict == "not measured here", !reproduced.has_value());
    if (!reproduced) continue;
    ++n_measured;
    EXPECT_FALSE(text_at(table, row, "records").empty());
    EXPECT_EQ(verdict.empty(), !published.has_value());
    if (!published) continue;
    EXPECT_DOUBLE_EQ(number_at(table, row, "difference").value(), *reproduced - *published);
    const char* prefix = number_at(table, row, "run_low") ? "run_" : "";
    const auto low = number_at(table, row, std::string(prefix) + "low");
    const auto high = number_at(table, row, std::string(prefix) + "high");
    if (!low || verdict == "not comparable") continue;
    EXPECT_EQ(verdict, *published >= *low && *published <= *high ? "within" : "outside");
  }
  EXPECT_GT(n_measured, 0U);
}

INSTANTIATE_TEST_SUITE_P(Tables, EveryTable, testing::ValuesIn(paper_tables().begin(), paper_tables().end()),
                         [](const auto& test) { return test.param.name; });

TEST(Comparison, MeansAndRangesOfSingleRuns) {
  std::vector<Record> records;
  for (const double e : {1.0, 2.0, 3.0}) {
    for (const int frame : {1, 2}) {
      Record r = test_record("d", "s", "e", "ego", frame, static_cast<uint64_t>(e));
      r.errors["Et_m"] = e;
      records.push_back(r);
    }
  }
  RecordRefs refs;
  for (const Record& r : records) refs.push_back(&r);
  PaperRow row;
  row.measured = measure_mean(refs, NumberMap::errors, "Et_m");
  const std::optional<Measured>& measured = row.measured;
  ASSERT_TRUE(measured && measured->one_run);
  EXPECT_DOUBLE_EQ(measured->value, 2);
  EXPECT_EQ(measured->n_pairs, 6);
  EXPECT_EQ(measured->n_seeds, 3);
  // m +- t_{2, 0.975} s sqrt(1 + 1/3), s = 1.
  EXPECT_NEAR(measured->one_run->high, 2 + 4.302653 * std::sqrt(4.0 / 3), 1e-5);
  EXPECT_FALSE(measure_mean(refs, NumberMap::errors, "no_such_error"));
  row.published = 2.5;
  EXPECT_EQ(row.verdict(), "within");
  row.published = -9;
  EXPECT_EQ(row.verdict(), "outside");
  row.reason = "another quantity";
  EXPECT_EQ(row.verdict(), "not comparable");
  row.measured.reset();
  EXPECT_EQ(row.verdict(), "not measured here");
}

TEST(Published, AMisspeltKeyIsNotAMissingValue) {
  const Json values = paper().published;
  EXPECT_DOUBLE_EQ(published_number(values.at("tab:cam_err").at("proposed"), "Et_m").value(), 0.0642);
  EXPECT_THROW(published_number(values.at("tab:cam_err").at("proposed"), "Et"), Error);
}

/// Returns the index of the row of `estimator`.
size_t row_of(const Table& table, const std::string& estimator) {
  for (size_t row = 0; row < table.rows.size(); ++row) {
    if (text_at(table, row, "estimator") == estimator) return row;
  }
  ADD_FAILURE() << "no row of " << estimator;
  return 0;
}

constexpr const char* vdo = "VDO_SLAM 9d33024.front";

std::vector<Record>& records_of_one_run(Evidence& evidence) {
  return std::ranges::find(evidence.parts, PartRole::systems, &EvidencePart::role)->records;
}

TEST(SystemsTable, ReportsAProgramsOwnTimeInFramesOfJointFlow) {
  Evidence evidence = test_evidence();
  for (Record& record : records_of_one_run(evidence)) {
    const double disturbed = record.seed == 1 ? 0 : 100;  // the second of three rounds was quiet
    if (record.estimator == vdo && record.is_ego())
      record.time_ms = {{"program", 240 + disturbed}, {"total", 900}};
    if (record.estimator == vdo && !record.is_ego()) record.time_ms = {{"total", 0}};
  }
  const Table table = systems_table(evidence);
  // Extraction 4 ms, the camera and three objects 5 ms each.
  EXPECT_EQ(number_at(table, row_of(table, "joint_flow"), "frame_ms"), 24);
  EXPECT_EQ(number_at(table, row_of(table, "joint_flow"), "frame_ratio"), 1);
  EXPECT_EQ(number_at(table, row_of(table, vdo), "frame_ms"), 240);
  EXPECT_EQ(number_at(table, row_of(table, vdo), "frame_ratio"), 10);
}

TEST(SystemsTable, CountsWhatWasNotEstimated) {
  Evidence evidence = test_evidence();
  for (Record& record : records_of_one_run(evidence)) {
    if (record.body != "object:3" || record.estimator != vdo) continue;
    record.status = Status::lost;
    record.errors.clear();
  }
  const Table table = systems_table(evidence);
  EXPECT_NEAR(number_at(table, row_of(table, vdo), "objects_coverage_percent").value(), 100.0 * 2 / 3, 1e-9);
  EXPECT_EQ(number_at(table, row_of(table, vdo), "coverage_percent"), 100);
  EXPECT_EQ(number_at(table, row_of(table, "joint_flow"), "objects_coverage_percent"), 100);
}

TEST(SystemsTable, ARowOfASystemNamesCommitChangesAndWhatOfTheTruthItSees) {
  const Table table = systems_table(test_evidence());
  const size_t row = row_of(table, vdo);
  EXPECT_EQ(text_at(table, row, "commit").substr(0, 7), "9d33024");
  EXPECT_THAT(text_at(table, row, "repository"), testing::HasSubstr("VDO_SLAM"));
  EXPECT_THAT(text_at(table, row, "sees"), testing::HasSubstr("objects"));
  EXPECT_THAT(text_at(table, row, "changes"), testing::HasSubstr("flow"));
  EXPECT_EQ(text_at(table, row_of(table, "joint_flow"), "commit"), "");
}

TEST(SystemsTable, EveryDescriptionIsWholeAndItsNameReportsTheCommit) {
  for (const Json& entry : system_descriptions()) {
    for (const char* key : {"estimator", "repository", "commit", "sees", "changes", "build"})
      EXPECT_FALSE(entry.at(key).get<std::string>().empty()) << key;
    EXPECT_EQ(entry.at("commit").get<std::string>().size(), 40u);
    EXPECT_THAT(entry.at("estimator").get<std::string>(),
                testing::HasSubstr(entry.at("commit").get<std::string>().substr(0, 7)));
  }
}

TEST(Attribution, ChangesAddUpToTheWhole) {
  Evidence evidence = test_evidence();
  for (Record& r : evidence.parts.back().records) {
    if (r.estimator == "motion_only > kernel") r.errors["Et_m"] *= r.is_ego() ? 0.25 : 0.5;
    if (r.estimator == "joint_flow > kernel" && r.frame == 3) r.status = Status::lost;
  }
  const std::vector<AttributionPath> paths = attribution_paths(evidence);
  ASSERT_EQ(paths.size(), 6U);  // camera, two objects; two paths each
  for (const AttributionPath& path : paths) {
    ASSERT_EQ(path.steps.size(), 2U);
    const AttributionStep& last = path.steps.back();
    EXPECT_NEAR(path.steps.front().Et_m.value + last.change_m.value, last.Et_m.value, 1e-15);
    EXPECT_DOUBLE_EQ(path.whole_m.value, last.change_m.value);
    EXPECT_EQ(path.n_seeds, 4U);
    EXPECT_TRUE(path.published_m);
    const bool from_motion_only = path.path == "motion_only";
    EXPECT_EQ(path.n_pairs, from_motion_only ? 48U : 44U) << "pairs that a step has lost count in none";
    const double factor = from_motion_only ? (path.body == "Ego" ? 0.25 : 0.5) : 1;
    EXPECT_NEAR(last.Et_m.value, factor * path.steps.front().Et_m.value, 1e-15);
  }
}

TEST(Attribution, StepsOfSeveralPartsAreOnePathInTheirOrder) {
  Evidence evidence = test_evidence();
  EvidencePart before = evidence.parts.back();
  before.name = "attribution_release";
  std::erase_if(before.records, [](const Record& r) { return r.estimator != "motion_only > kernel"; });
  for (Record& r : before.records) r.estimator = "motion_only > draws";
  evidence.parts.insert(evidence.parts.end() - 1, before);
  const std::vector<AttributionPath> paths = attribution_paths(evidence);
  const auto path = std::ranges::find(paths, "motion_only", &AttributionPath::path);
  ASSERT_NE(path, paths.end());
  ASSERT_EQ(path->steps.size(), 3U);
  EXPECT_EQ(path->steps[0].decision, "draws");
  EXPECT_EQ(path->steps[2].decision, "kernel");
}

}  // namespace
}  // namespace sextant
