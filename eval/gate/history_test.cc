#include "sextant/eval/gate/history.h"

#include <sys/wait.h>

#include <cstdlib>

#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/gate/testing.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

/// Twelve results; from run-8 on, the camera's translation error is 10 % larger and the solver 20 % slower.
class Past : public ::testing::Test {
 protected:
  Past() {
    for (int i = 0; i < 12; ++i) {
      std::vector<Record> records = sweep_records(2);
      for (Record& r : records) {
        if (i >= 8 && r.is_ego()) r.errors["Et_m"] *= 1.1;
      }
      const std::filesystem::path folder = temp_.path() / fmt::format("run-{}", i);
      write_run(folder, records);
      write_file(folder / "benchmark.json",
                 benchmark_json(5, static_cast<uint64_t>(i), i >= 8 ? 1.2 : 1.0, 0.01).dump());
    }
  }

  const Series& series(const History& history, const std::string& name, const std::string& metric) const {
    for (const Series& s : history.series) {
      if (s.name == name && s.metric == metric) return s;
    }
    throw InternalError(name + " " + metric);
  }

  TempFolder temp_;
  const Policy policy_;
};

TEST_F(Past, ChangesOfLevelAreFoundWhereTheyHappened) {
  const History history = read_history({temp_.path()}, policy_);
  ASSERT_EQ(history.labels.size(), 12U);
  EXPECT_THAT(history.labels[10], HasSubstr("run-10"));  // after run-9
  EXPECT_THAT(series(history, "synthetic s18 joint_flow level 0.1 camera", "Et_m").changes, ElementsAre(8));
  EXPECT_THAT(series(history, "synthetic s18 joint_flow level 0.1 objects", "Et_m").changes, ElementsAre());
  EXPECT_THAT(series(history, "estimate/joint_flow/3000", "benchmark").changes, ElementsAre(8));
  EXPECT_THAT(series(history, "ransac/3000/30", "benchmark").changes, ElementsAre());
}

TEST_F(Past, ResultsOfOtherDefinitionsHaveNoTrend) {
  const std::filesystem::path file = temp_.path() / "run-9" / "run.json";
  Json run = read_json(file);
  run["metric_definitions"]["Et_m"] = "2: in mm";
  write_file(file, run.dump());
  expect_error([&] { read_history({temp_.path()}, policy_); }, "run-9/run.json: Et_m is defined as");
}

TEST_F(Past, OtherNoiseIsAnotherSeriesAndOtherOptionsAreNamed) {
  std::vector<Record> records = sweep_records(2);
  for (Record& r : records) r.noise = "flow 2 px";
  write_run(temp_.path() / "run-11", records);
  const std::filesystem::path file = temp_.path() / "run-9" / "run.json";
  Json run = read_json(file);
  run["configuration"]["options"]["sigma_px"] = 2.5;
  write_file(file, run.dump());
  const History history = read_history({temp_.path()}, policy_);
  size_t n_other = 0;
  for (const Series& s : history.series) {
    if (s.name.find("(flow 2 px)") == std::string::npos) continue;
    ++n_other;
    EXPECT_FALSE(s.values.front()) << s.name;
    EXPECT_TRUE(s.values.back()) << s.name;
  }
  EXPECT_GT(n_other, 0U);
  ASSERT_EQ(history.warnings.size(), 3U);  // run-9; run-10, which is as before; the other noise of run-11
  EXPECT_THAT(history.warnings[2],
              AllOf(HasSubstr("run-11"), HasSubstr("are missing"), HasSubstr("are new")));
  EXPECT_THAT(history.warnings[0], AllOf(HasSubstr("run-9"), HasSubstr("sigma_px: 2.5, before it 1.0")));
  EXPECT_THAT(history_document(history).abstract, HasSubstr(history.warnings[1]));
}

TEST_F(Past, IncompleteResultsAreNamed) {
  EXPECT_TRUE(read_history({temp_.path()}, policy_).warnings.empty());
  const auto warnings = [&](const std::function<void(std::vector<Record>&)>& change, uint64_t stated) {
    std::vector<Record> records = sweep_records(2);
    change(records);
    Json run = sweep_provenance();
    if (stated > 0) run["records"] = stated;
    write_run(temp_.path() / "run-11", records, run);
    return read_history({temp_.path()}, policy_).warnings;
  };
  const auto without_object = [](std::vector<Record>& records) {
    std::erase_if(records, [](const Record& r) { return r.body == "object:2"; });
  };
  EXPECT_THAT(warnings(without_object, 0),
              ElementsAre(AllOf(HasSubstr("run-11"),
                                HasSubstr(": 24 cases of the result before it are missing and 0 are new"),
                                HasSubstr("object:2: 12 of its cases missing"))));
  EXPECT_THAT(warnings(without_object, 72),
              Contains(HasSubstr("records.jsonl holds 48 records, but run.json states 72")));
  const auto without_errors = [](std::vector<Record>& records) {
    for (Record& r : records)
      if (r.frame == 1) r.errors.clear();
  };
  EXPECT_THAT(warnings(without_errors, 0), Contains(HasSubstr("12 records have status ok, but no error")));
}

TEST_F(Past, TimesAreTheKindThatThePolicyOrTheNameRequests) {
  const auto last = [&](const Policy& policy, const std::string& name) {
    return series(read_history({temp_.path()}, policy), name, "benchmark").values.back().value();
  };
  Policy real;
  real.speed.time = BenchmarkTime::real;
  const std::string plain = "ransac/3000/30", named = "ransac/3000/30/real_time";
  const double cpu_ms = last(policy_, plain);
  EXPECT_NEAR(last(real, plain) / cpu_ms, 310.0 / 300, 1e-12);
  for (int i = 0; i < 12; ++i) {
    const std::filesystem::path file = temp_.path() / fmt::format("run-{}", i) / "benchmark.json";
    Json json = Json::parse(read_file(file));
    for (Json& entry : json["benchmarks"]) {
      if (entry["run_name"] == plain) entry["run_name"] = named;
    }
    write_file(file, json.dump());
  }
  EXPECT_NEAR(last(policy_, named) / cpu_ms, 310.0 / 300, 1e-12);
}

TEST_F(Past, FewerThanSixResultsDoNotShowTheirNoise) {
  const auto since = [&](int first) {
    std::vector<std::filesystem::path> paths;
    for (int i = first; i < 10; ++i) paths.push_back(temp_.path() / fmt::format("run-{}", i));
    return read_history(paths, policy_);
  };
  const std::string camera = "synthetic s18 joint_flow level 0.1 camera";
  EXPECT_THAT(series(since(5), camera, "Et_m").changes, ElementsAre());
  EXPECT_THAT(series(since(5), "estimate/joint_flow/3000", "benchmark").changes, ElementsAre());
  EXPECT_THAT(series(since(4), camera, "Et_m").changes, ElementsAre(4));
  EXPECT_THAT(series(since(4), "estimate/joint_flow/3000", "benchmark").changes, ElementsAre(4));
}

TEST_F(Past, DisturbedCasesAreNoLevelOfARunsTimes) {
  const auto slow_down = [&](int i, int every) {
    std::vector<Record> records = sweep_records(2);
    for (Record& r : records) r.time_ms["refine"] *= r.frame % every == 0 ? 4 : 1;
    write_file(temp_.path() / fmt::format("run-{}", i) / "records.jsonl", write_records(records));
  };
  const auto changes = [&] {
    return series(read_history({temp_.path()}, policy_), "synthetic s18 joint_flow refine", "time").changes;
  };
  for (const int i : {4, 8, 9, 10, 11}) slow_down(i, 3);  // a third of the frames
  EXPECT_THAT(changes(), ElementsAre());
  for (const int i : {8, 9, 10, 11}) slow_down(i, 1);
  EXPECT_THAT(changes(), ElementsAre(8));
}

TEST_F(Past, NamesOfStrangersStayNames) {
  const std::filesystem::path planted = temp_.path() / "planted";
  History history;
  for (const std::string& text : hostile_texts(planted)) history.labels.push_back(text);
  for (const std::string& text : hostile_texts(planted)) {
    Series series{text, text, text};
    for (size_t i = 0; i < history.labels.size(); ++i) series.values.emplace_back(static_cast<double>(i));
    history.series.push_back(series);
  }
  std::vector<Figure> figures;
  for (size_t shift = 0; shift < 3; ++shift) {  // every third label is on the axis
    for (const ReportSection& section : history_document(history).sections)
      figures.insert(figures.end(), section.figures.begin(),
                     section.figures.begin() + (section.figures.empty() ? 0 : 8));
    for (size_t i = 0; i < figures.size(); ++i) figures[i].name = fmt::format("series-{}", i);
    std::ranges::rotate(history.labels, history.labels.begin() + 1);
  }
  expect_drawn(figures, planted);
}

TEST_F(Past, PageOpensInABrowser) {
  const ReportDocument document = history_document(read_history({temp_.path()}, policy_));
  const std::string html = report_page(document, 2);
  EXPECT_THAT(html, HasSubstr("Changes of level"));
  EXPECT_THAT(html, Not(HasSubstr("https:")));
  if (std::system("command -v chromium > /dev/null") != 0)
    GTEST_SKIP() << "no chromium to open the page with";
  write_file(temp_.path() / "trend.html", html);
  const std::string out = (temp_.path() / "dom").string();
  const int status =
      std::system(fmt::format("chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
                              "--disable-background-networking --user-data-dir={0}/profile --dump-dom "
                              "file://{0}/trend.html > {1} 2> /dev/null",
                              temp_.path().string(), out)
                      .c_str());
  ASSERT_EQ(WEXITSTATUS(status), 0);
  const std::string dom = read_file(out);
  EXPECT_THAT(dom, HasSubstr("Changes of level"));
  EXPECT_THAT(dom, HasSubstr("<button type=\"button\" title=\"sort\">"));  // its script has run
}

TEST_F(Past, FoldersOfSummariesAndInterruptedSweepsAreRefusedAsSuch) {
  for (const auto& [file, message] : {std::pair("summary.bin", "the sweep kept summaries"),
                                      std::pair("journal.jsonl", "its sweep is not finished")}) {
    const std::filesystem::path folder = temp_.path() / "sweep";
    std::filesystem::create_directories(folder);
    write_file(folder / "plan.json", "{}");
    write_file(folder / file, "");
    EXPECT_THAT(error_of([&] {
                  read_history({folder, temp_.path() / "run-1"}, policy_);
                }),
                HasSubstr(message));
    std::filesystem::remove_all(folder);
  }
}

TEST_F(Past, OneResultOrNoneIsNoTrend) {
  EXPECT_THROW(read_history({temp_.path() / "run-1"}, policy_), Error);
  EXPECT_THROW(read_history({temp_.path() / "nothing"}, policy_), Error);
  EXPECT_EQ(read_history({temp_.path() / "run-3", temp_.path() / "run-1"}, policy_).labels.size(), 2U);
}

}  // namespace
}  // namespace sextant
