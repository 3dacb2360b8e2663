// Sweeps that keep summaries: what they hold, and that no job, shard or kill changes a byte.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/plan_testing.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/experiment/sweep_status.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

using ::testing::HasSubstr;

class SweepSummary : public SmallPlan, public testing::Test {
 protected:
  SweepConfig config(const std::string& out, KeepOfCases keep = KeepOfCases::summary) const {
    SweepConfig config;
    config.plan = parse_plan(plan_text(), "plan.json", "");
    config.plan.keep = keep;
    config.out = file(out);
    config.cache = PackCache(file("cache"));
    config.quiet = true;
    return config;
  }
  fs::path file(const std::string& name) const { return folder_.path() / name; }
  std::string bytes(const std::string& out) const { return read_file(file(out) / summary_file_name); }
  Json noise_of(const std::string& out) const { return read_json(file(out) / "run.json")["noise"]; }

  /// Numbers within 1e-12 of their size, everything else equal.
  static void expect_near(const Json& a, const Json& b) {
    if (a.is_number_float() && b.is_number_float()) {
      EXPECT_NEAR(a.get<double>(), b.get<double>(), 1e-12 * (1 + std::abs(b.get<double>())));
    } else if (a.is_structured() && b.is_structured() && a.size() == b.size()) {
      for (auto x = a.begin(), y = b.begin(); x != a.end(); ++x, ++y) expect_near(*x, *y);
    } else {
      EXPECT_EQ(a, b);
    }
  }

  std::vector<fs::path> run_shards(uint64_t n, KeepOfCases keep = KeepOfCases::summary) const {
    std::vector<fs::path> parts;
    for (uint64_t shard = 0; shard < n; ++shard) {
      SweepConfig part = config(fmt::format("part{}of{}", shard, n), keep);
      part.shard = shard;
      part.n_shards = n;
      sweep(part);
      parts.push_back(part.out);
    }
    return parts;
  }
};

TEST_F(SweepSummary, AreThoseOfTheRecords) {
  sweep(config("records", KeepOfCases::records));
  const SweepOutcome outcome = sweep(config("sums"));
  EXPECT_EQ(outcome.n_cases, 12U);
  EXPECT_FALSE(fs::exists(file("sums") / "records.jsonl"));
  EXPECT_FALSE(fs::exists(file("sums") / "cases.jsonl"));
  const auto records = open_case_results(file("records"), KeepOfCases::records);
  const auto sums = open_case_results(file("sums"), KeepOfCases::summary);
  uint64_t n_records = 0;
  for (int i = 0; i < 12; ++i) {
    const auto of_records = records->next(), of_sums = sums->next();
    ASSERT_TRUE(of_records && of_sums);
    EXPECT_EQ(of_records->number, of_sums->number);
    const CaseSummary found = decode_case_summary(of_sums->content, "summary");
    EXPECT_EQ(found, summarize_case(parse_records(of_records->content, "records")));
    EXPECT_EQ(found.n_records(), of_records->n_records);
    n_records += found.n_records();
  }
  EXPECT_FALSE(sums->next());
  EXPECT_EQ(outcome.n_records, n_records);
  expect_near(noise_of("sums"), noise_of("records"));
  EXPECT_EQ(read_json(file("sums") / "run.json")["configuration"]["keep"], "summary");
  EXPECT_FALSE(read_json(file("records") / "run.json")["configuration"].contains("keep"));
}

TEST_F(SweepSummary, JobsAndShardsDoNotChangeAByte) {
  sweep(config("one"));
  SweepConfig three = config("three");
  three.jobs = 3;
  sweep(three);
  EXPECT_EQ(bytes("three"), bytes("one"));
  for (const uint64_t n : {2, 5}) {
    std::vector<fs::path> parts = run_shards(n);
    std::ranges::reverse(parts);
    const std::string out = fmt::format("merged{}", n);
    const SweepOutcome merged = merge_sweeps(parts, file(out));
    EXPECT_EQ(merged.n_cases, 12U);
    EXPECT_EQ(merged.n_records, sweep(config("one")).n_records);
    EXPECT_EQ(bytes(out), bytes("one"));
    EXPECT_EQ(noise_of(out), noise_of("one"));
    parts.pop_back();
    EXPECT_THAT(error_of([&] { merge_sweeps(parts, file("m")); }), HasSubstr("a shard is missing"));
  }
}

TEST_F(SweepSummary, ResumesFromAnyCutOfTheJournal) {
  sweep(config("whole"));
  const fs::path folder = file("cut");
  const auto begin_again = [&] {
    fs::remove_all(folder);
    fs::create_directories(folder);
    fs::copy_file(file("whole") / "plan.json", folder / "plan.json");
  };
  // All cases are done, and the results cannot be moved into place.
  fs::create_directories(file("full") / "run.json" / "in the way");
  EXPECT_THAT(error_of([&] { sweep(config("full")); }), HasSubstr("run.json"));
  const std::string journal = read_file(file("full") / "journal.jsonl");
  begin_again();
  write_file(folder / "journal.jsonl", journal);
  EXPECT_EQ(sweep(config("cut")).n_before, 12U);
  for (size_t cut = 1; cut < journal.size(); cut += journal.size() / 7) {
    begin_again();
    write_file(folder / "journal.jsonl", std::string_view(journal).substr(0, journal.size() - cut));
    const SweepOutcome outcome = sweep(config("cut"));
    EXPECT_LT(outcome.n_before, 12U);
    EXPECT_EQ(outcome.n_before > 0, cut < journal.size() * 11 / 12) << cut;
    EXPECT_EQ(bytes("cut"), bytes("whole")) << cut;
    EXPECT_EQ(noise_of("cut"), noise_of("whole")) << cut;
  }
}

TEST_F(SweepSummary, DamagedFilesAreNamed) {
  const std::vector<fs::path> parts = run_shards(2);
  const fs::path path = parts[1] / summary_file_name;
  const std::string good = read_file(path);
  const auto merging = [&](const std::string& text) {
    write_file(path, text);
    return error_of([&] { merge_sweeps(parts, file("m")); });
  };
  EXPECT_THAT(merging(good.substr(0, good.size() / 2)), testing::ContainsRegex("summary.bin: cut off after [1-5] of 6 cases"));
  EXPECT_THAT(merging(good.substr(0, good.size() - 1)), HasSubstr("summary.bin: cut off after 6 of 6 cases"));
  EXPECT_THAT(merging(good + "x"), HasSubstr("summary.bin: has more than 6 cases"));
  std::string flipped = good;
  flipped[flipped.size() - 40] ^= 1;
  EXPECT_THAT(merging(flipped), HasSubstr("damaged: its SHA-256 differs"));
  EXPECT_THAT(merging("{\"schema\":1}\n"), HasSubstr("not a file of case summaries"));
  EXPECT_THAT(merging(""), HasSubstr("not a file of case summaries"));
  std::string other = good;
  other.replace(other.find("ER_deg"), 6, "ER_rad");
  EXPECT_THAT(merging(other), HasSubstr("sums up the errors"));
  EXPECT_FALSE(fs::exists(file("m")));
  write_file(path, good);
  merge_sweeps(parts, file("m"));
}

TEST_F(SweepSummary, AndRecordsAreDifferentSweeps) {
  sweep(config("sums"));
  EXPECT_THAT(error_of([&] { sweep(config("sums", KeepOfCases::records)); }), HasSubstr("holds a sweep of another plan"));
  EXPECT_THAT(error_of([&] { read_records(file("sums") / "records.jsonl"); }),
              HasSubstr("\"keep\": \"summary\""));
  std::vector<fs::path> parts = run_shards(2);
  fs::remove_all(parts[1]);
  SweepConfig other = config("other", KeepOfCases::records);
  other.shard = 1;
  other.n_shards = 2;
  sweep(other);
  parts[1] = other.out;
  EXPECT_THAT(error_of([&] { merge_sweeps(parts, file("m")); }), HasSubstr("another plan"));
}

TEST_F(SweepSummary, StatusCountsTheirCases) {
  for (const uint64_t shard : {1, 2}) {
    SweepConfig part = config(fmt::format("shards/{}", shard));
    part.shard = shard;
    part.n_shards = 3;
    sweep(part);
  }
  const SweepStatus status = sweep_status(folder_.path(), 0);
  EXPECT_EQ(status.to_submit(), "3");
  EXPECT_EQ(status.cases_done(), 8U);
}

TEST_F(SweepSummary, KeepIsAKeyOfThePlan) {
  const auto with = [&](const std::string& keep) {
    std::string text = plan_text();
    text.insert(text.size() - 1, ",\n\"keep\":" + keep);
    return text;
  };
  EXPECT_EQ(parse_plan(with("\"summary\""), "p", "").keep, KeepOfCases::summary);
  EXPECT_EQ(parse_plan(with("\"records\""), "p", "").json(), parse_plan(plan_text(), "p", "").json());
  EXPECT_THAT(error_of([&] { parse_plan(with("\"sums\""), "p", ""); }),
              HasSubstr("p:5: keep: unknown value of 'keep' 'sums'"));
}

TEST_F(SweepSummary, ManySeedsStandAsARange) {
  const Plan plan = parse_plan(plan_text(R"({"level":0,"noise":{}})", R"({"first":7,"count":1000000})"), "p", "");
  EXPECT_EQ(plan.json()["seeds"], (Json{{"first", 7}, {"count", 1000000}}));
  EXPECT_EQ(planned_seeds(plan.json(), "p"), 1000000U);
  EXPECT_EQ(planned_seeds(parse_plan(plan_text(), "p", "").json(), "p"), 3U);
}

}  // namespace
}  // namespace sextant
