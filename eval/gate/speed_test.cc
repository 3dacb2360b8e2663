#include "sextant/eval/gate/speed.h"

#include "sextant/base/testing.h"
#include "sextant/eval/gate/testing.h"

namespace sextant {
namespace {

TEST_F(ComparedRuns, OneRunOfEachSideIsNoProofOfSpeed) {
  const auto slower = [](double factor) { return [factor](Record& r) { r.time_ms["refine"] *= factor; }; };
  EXPECT_EQ(compare_changed(slower(1.15)).verdict, GateVerdict::ok);
  EXPECT_EQ(compare_changed(slower(2)).verdict, GateVerdict::inconclusive);
  EXPECT_EQ(compare_changed(slower(0.4)).verdict, GateVerdict::ok);
  int n = 0;
  const auto often_slower = [&](Record& r) { r.time_ms["refine"] *= ++n % 5 == 0 ? 1 : 3; };
  EXPECT_EQ(compare_changed(often_slower).verdict, GateVerdict::ok);  // the processor was busy
  EXPECT_EQ(compare_changed([](Record& r) {
              if (!r.is_ego()) r.time_ms["refine"] *= 3;
            }).verdict,
            GateVerdict::inconclusive);
}

TEST_F(ComparedRuns, TimesThatAreNotJudgedAreNoted) {
  std::vector<Record> records = sweep_records();
  for (Record& record : records) record.time_ms.clear();
  write_run(base(), records);  // as a baseline
  write_run(fresh(), sweep_records());
  const Comparison c = compare();
  EXPECT_EQ(c.verdict, GateVerdict::ok) << headline(c);
  ASSERT_EQ(c.findings.size(), 1U);
  EXPECT_EQ(c.findings[0].subject, "times are not judged");
  EXPECT_EQ(c.findings[0].base, "missing");
  EXPECT_EQ(c.findings[0].fresh, "there");
  Policy accuracy_only;
  accuracy_only.speed.judge = false;
  EXPECT_TRUE(compare(accuracy_only).findings.empty());
}

TEST_F(ComparedRuns, RepeatedRunsAreJudgedByTheirTimes) {
  const auto write = [&](const fs::path& side, double factor) {
    fs::remove_all(side);
    for (int i = 0; i < 6; ++i) {
      std::vector<Record> records = sweep_records();
      for (Record& r : records) r.time_ms["refine"] *= factor * (1 + 0.01 * ((i * 7) % 5));
      write_run(side / std::to_string(i), records);
    }
  };
  write(base(), 1);
  write(fresh(), 1.15);
  const Comparison c = compare();
  EXPECT_EQ(c.verdict, GateVerdict::regressed) << headline(c);
  ASSERT_EQ(c.findings.size(), 2U);
  EXPECT_EQ(c.findings[1].what, "repetitions");
  EXPECT_FALSE(c.findings[1].invalidates);
  EXPECT_THAT(c.findings[1].subject,
              HasSubstr("new: errors and statuses are judged in 0 only, the first of 6 runs"));
  Policy speed_only;
  speed_only.accuracy.judge = false;
  EXPECT_TRUE(compare(speed_only).findings.empty());
  const Table speeds = speed_table(c, true);
  EXPECT_THAT(*speeds.rows.at(0).at(0).text(), HasSubstr("refine"));
  EXPECT_EQ(compare_paths(fresh(), base(), defaults(), 1).verdict, GateVerdict::improved);
  write(fresh(), 1);
  EXPECT_EQ(compare().verdict, GateVerdict::ok);
  std::vector<Record> records = sweep_records();
  records.pop_back();
  write_run(fresh() / "3", records);
  EXPECT_EQ(compare().verdict, GateVerdict::invalid);
}

TEST_F(ComparedRuns, ABodyThatIsMissingChangesNoTime) {
  // The objects need different times, so that their median depends on which of them are there.
  const auto write = [](const fs::path& side, double factor, bool loses_object) {
    std::vector<Record> records = sweep_records();
    for (Record& r : records) {
      r.time_ms["refine"] *= factor * (r.body == "object:2" ? 5 : 1);
      if (loses_object && r.body == "object:1") r.status = Status::lost;
    }
    write_run(side, records);
  };
  write(base(), 1, false);
  for (const double factor : {1.0, 1.2}) {
    write(fresh(), factor, true);
    int n_judged = 0;
    for (const SpeedRow& row : compare().speed) {
      if (!row.name.ends_with("refine of objects")) continue;
      EXPECT_NEAR(row.ratio, factor, 1e-9) << row.name;
      ++n_judged;
    }
    EXPECT_EQ(n_judged, 2);
  }
}

TEST_F(ComparedRuns, BenchmarksAreJudgedByTheirRepetitions) {
  int n_regressed = 0, n_false = 0;
  for (uint64_t draw = 0; draw < 40; ++draw) {
    n_false +=
        compare_benchmarks(benchmark_json(10, 2 * draw), benchmark_json(10, 2 * draw + 1)) != GateVerdict::ok;
    n_regressed += compare_benchmarks(benchmark_json(10, 2 * draw), benchmark_json(10, 2 * draw + 1, 1.15)) ==
                   GateVerdict::regressed;
  }
  EXPECT_EQ(n_false, 0);
  EXPECT_GE(n_regressed, 38);
  EXPECT_EQ(compare_benchmarks(benchmark_json(10, 1), benchmark_json(10, 2, 0.8)), GateVerdict::improved);
}

TEST_F(ComparedRuns, OneSampleIsInconclusiveOnlyWhereItIsMuchSlower) {
  EXPECT_EQ(compare_benchmarks(benchmark_json(1, 1), benchmark_json(1, 2)), GateVerdict::ok);
  EXPECT_EQ(compare_benchmarks(benchmark_json(1, 1), benchmark_json(1, 2, 2)), GateVerdict::inconclusive);
  EXPECT_EQ(compare_benchmarks(benchmark_json(1, 1), benchmark_json(1, 2, 0.4)), GateVerdict::ok);
  EXPECT_EQ(compare_benchmarks(benchmark_json(10, 1, 1, 0.3), benchmark_json(10, 4, 1.3, 0.3)),
            GateVerdict::inconclusive);  // slower, but too noisy to be sure
}

TEST_F(ComparedRuns, BenchmarksThatAreMissingOrBrokenAreInvalid) {
  const Json good = benchmark_json(10, 1);
  const auto changed = [&](const std::function<void(Json&)>& change) {
    Json json = good;
    change(json);
    return compare_benchmarks(good, json);
  };
  EXPECT_EQ(changed([](Json&) {}), GateVerdict::ok);
  EXPECT_EQ(changed([](Json& j) {
              Json& list = j["benchmarks"];
              list.erase(list.begin() + 10, list.end());
            }),
            GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["benchmarks"] = Json::array(); }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["benchmarks"][3]["cpu_time"] = nullptr; }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["benchmarks"][3]["cpu_time"] = 0; }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["benchmarks"][3]["cpu_time"] = -1; }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["benchmarks"][3]["error_occurred"] = true; }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["benchmarks"][3]["time_unit"] = "min"; }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["context"]["num_cpus"] = 64; }), GateVerdict::invalid);
  EXPECT_EQ(changed([](Json& j) { j["context"]["library_build_type"] = "debug"; }), GateVerdict::invalid);
}

}  // namespace
}  // namespace sextant
