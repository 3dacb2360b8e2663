// Compares the report of a sweep that kept summaries with the report of the same sweep's records: tables,
// claims, and the list of what summaries leave open.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "sextant/base/files.h"
#include "sextant/base/philox.h"
#include "sextant/base/testing.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/workflow/workflow.h"

namespace sextant {
namespace {

using ::testing::HasSubstr;

/// Records of one case: camera and three objects over five frames, some without an estimate or a bound.
/// With `gaps` the estimator misses frames of object 3 that depend on its name.
std::vector<Record> case_of(const std::string& estimator, double level, uint64_t seed, bool gaps) {
  std::vector<Record> records;
  for (int frame = 1; frame <= 5; ++frame) {
    for (int body = 0; body <= 3; ++body) {
      PhiloxStream random(1000 * seed + static_cast<uint64_t>(frame),
                          static_cast<uint64_t>(10 * body + 100 * level));
      const double gain = estimator == "b" ? 0.9 : 1.0;
      Record r = RecordOf{
          "d",   "s",  estimator, body == 0 ? "ego" : object_body(body), fmt::format("flow {}", level),
          level, seed, frame};
      r.values["nees"] = 5 + 2 * random.uniform();
      if (body > 0) r.values["distance_gt_m"] = 10.0 * body + 0.1 * frame;
      r.errors["Et_m"] = gain * level * (body + 1) * (0.01 + random.uniform());
      r.errors["ER_deg"] = frame == 5 && body == 0 ? 0 : 0.2 * level * (0.01 + random.uniform());
      r.errors["epe_initial_px"] = level + 0.1 * random.uniform();
      r.flow_truth = "given";
      if (frame != 2) r.bound = {{"Et_m", 0.3 * level}, {"ER_deg", 0.05 * level}};
      const bool is_missed =
          (body == 2 && frame == 3) || (gaps && body == 3 && frame == 1 + static_cast<int>(seed % 3));
      if (is_missed) {
        r.status = Status::gated;
        r.gate = Gate::distance;
        r.errors = {};
        r.bound = {};
      }
      records.push_back(std::move(r));
    }
  }
  return records;
}

struct Folders {
  TempFolder temp;
  fs::path records = temp.path() / "records", summaries = temp.path() / "summaries";

  Folders(uint64_t n_seeds, bool gaps) {
    std::vector<Record> all;
    std::vector<std::string> cases;
    Json levels = Json::array();
    for (const double level : {0.5, 1.0, 1.5})
      levels.push_back({{"level", level}, {"noise", {{"flow", {{"scale", level}}}}}});
    for (const std::string estimator : {"a", "b"}) {
      for (const double level : {0.5, 1.0, 1.5}) {
        for (uint64_t seed = 0; seed < n_seeds; ++seed) {
          const std::vector<Record> of_case = case_of(estimator, level, seed, gaps && estimator == "b");
          all.insert(all.end(), of_case.begin(), of_case.end());
          cases.push_back(encode_case_summary(summarize_case(of_case)));
        }
      }
    }
    for (const fs::path& folder : {records, summaries}) {
      fs::create_directories(folder);
      write_file(folder / "run.json", json_text({{"configuration", {{"noise", levels}}}}));
    }
    write_file(records / "records.jsonl", write_records(all));
    SummaryWriter writer(summaries / summary_file_name, cases.size());
    for (size_t i = 0; i < cases.size(); ++i) writer.append(i, cases[i]);
    writer.close("");
  }
};

/// Tables of the report by name, with rows as JSON.
std::map<std::string, Json> tables_of(const fs::path& folder) {
  std::map<std::string, Json> tables;
  for (const ReportSection& section : noise_document({folder}, 2).sections) {
    for (const NamedTable& named : section.tables) tables[named.name] = rows_to_json(named.table);
  }
  return tables;
}

bool is_quantile(const std::string& key) {
  for (const char* word : {"_q05", "_q25", "_median", "_q75", "_q95"}) {
    if (key.find(word) != std::string::npos) return true;
  }
  return false;
}

void expect_equal_rows(const Json& found, const Json& wanted, const std::string& table) {
  ASSERT_EQ(found.size(), wanted.size()) << table;
  for (size_t row = 0; row < wanted.size(); ++row) {
    ASSERT_EQ(found[row].size(), wanted[row].size());
    for (const auto& [key, value] : wanted[row].items()) {
      const std::string where = fmt::format("{} row {}: {}", table, row, key);
      ASSERT_TRUE(found[row].contains(key)) << where;
      if (!value.is_number()) {
        EXPECT_EQ(found[row][key], value) << where;
        continue;
      }
      const double number = value.get<double>();
      const bool is_end = key.find("_low") != std::string::npos || key.find("_high") != std::string::npos;
      // The ends of a quantile's interval are quantiles of bootstrap replicates, which jump between values
      // of a small sample.
      const double tolerance = is_quantile(key) ? (is_end ? 0.05 : 0.005) : 1e-12;
      EXPECT_NEAR(found[row][key].get<double>(), number,
                  tolerance * std::max(std::abs(number), is_quantile(key) ? 0.0 : 1.0))
          << where;
    }
  }
}

TEST(SummaryReport, IsThatOfTheRecords) {
  const Folders folders(8, /*gaps=*/false);
  const std::map<std::string, Json> wanted = tables_of(folders.records);
  std::map<std::string, Json> found = tables_of(folders.summaries);
  ASSERT_EQ(found.at("summaries").size(), 1U);
  found.erase("summaries");
  EXPECT_TRUE(wanted.contains("comparisons"));
  ASSERT_EQ(found.size(), wanted.size());
  for (const auto& [name, rows] : wanted) expect_equal_rows(found.at(name), rows, name);
}

/// Returns how many records the link of a row states, and checks the address of the link.
int n_behind(const Json& row) {
  EXPECT_EQ(row.value("records_file", ""), "../records/records.jsonl") << row.dump();
  return std::stoi(row.value("records", "0"));
}

TEST(NoiseDocument, WarnsOfIntervalsOfFewSeeds) {
  for (const auto& [n_seeds, coverage] : {std::pair(2, "= 50 %"), {3, "= 75 %"}, {4, "= 87.5 %"}}) {
    const ReportDocument document =
        noise_document({Folders(static_cast<uint64_t>(n_seeds), /*gaps=*/false).records}, 1);
    EXPECT_THAT(document.warnings,
                ElementsAre(AllOf(HasSubstr(fmt::format("of {} clusters", n_seeds)), HasSubstr(coverage))));
    EXPECT_THAT(document.abstract, HasSubstr(coverage));
  }
  EXPECT_THAT(noise_document({Folders(5, /*gaps=*/false).records}, 1).warnings, IsEmpty());
}

TEST(NoiseDocument, EveryRowLeadsToTheRecordsBehindIt) {
  const Folders folders(8, /*gaps=*/false);
  const ReportDocument document = noise_document({folders.records}, 2, true, folders.temp.path() / "out");
  std::map<std::string, Json> tables;
  for (const ReportSection& section : document.sections) {
    for (const NamedTable& named : section.tables) tables[named.name] = rows_to_json(named.table);
  }
  constexpr int n_frames = 5, n_seeds = 8, n_levels = 3;
  for (const Json& row : tables.at("noise_levels")) EXPECT_EQ(n_behind(row), n_frames * n_seeds);
  for (const Json& row : tables.at("trends")) EXPECT_EQ(n_behind(row), n_frames * n_seeds * n_levels);
  for (const Json& row : tables.at("comparisons")) EXPECT_EQ(n_behind(row), n_frames * n_seeds * 2);
  EXPECT_TRUE(document.verdicts.empty());  // statements of the paper belong to the reproduction
  EXPECT_EQ(document.sections.front().tables.front().name, "comparisons");
}

TEST(SummaryReport, LeavesOutComparisonsOverDifferentPairs) {
  const Folders folders(8, /*gaps=*/true);
  const std::map<std::string, Json> wanted = tables_of(folders.records), found = tables_of(folders.summaries);
  for (const char* name : {"noise_levels", "trends"})
    expect_equal_rows(found.at(name), wanted.at(name), name);
  EXPECT_EQ(wanted.at("comparisons").size(), 12U);  // 4 bodies x 3 levels
  EXPECT_EQ(found.at("comparisons").size(), 9U);
  EXPECT_THAT(found.at("summaries").dump(), HasSubstr("3 of 12 comparisons"));
}

TEST(SummaryReport, OfOneSeedHasNoIntervals) {
  const Folders folders(1, /*gaps=*/false);
  const std::map<std::string, Json> found = tables_of(folders.summaries);
  EXPECT_THAT(found.at("summaries").dump(), HasSubstr("intervals of one seed"));
  const Json& row = found.at("noise_levels")[0];
  EXPECT_TRUE(row.contains("Et_mean_m"));
  EXPECT_TRUE(!row.contains("Et_mean_low_m") || row["Et_mean_low_m"].is_null());
}

TEST(SummaryReport, RefusesACaseTwice) {
  const Folders folders(2, /*gaps=*/false);
  EXPECT_THAT(error_of([&] {
                noise_document({folders.summaries, folders.summaries}, 1);
              }),
              HasSubstr("give each case once"));
  EXPECT_THAT(error_of([&] {
                noise_document({folders.records, folders.summaries}, 1);
              }),
              HasSubstr("in a folder of records and in a folder of summaries"));
}

}  // namespace
}  // namespace sextant
