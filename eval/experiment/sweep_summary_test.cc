// Sweeps with summaries: their content, and its independence of jobs, shards and interruptions.

#include <cmath>

#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/plan_testing.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

class SweepSummary : public SmallPlan {
 protected:
  SweepConfig config(const std::string& out, KeepOfCases keep = KeepOfCases::summary) const {
    return SmallPlan::config(out, keep);
  }
  std::string bytes(const std::string& out) const { return read_file(file(out) / summary_file_name); }

  /// Expects numbers that agree to 1e-12 of their magnitude, and everything else equal.
  static void expect_near(const Json& a, const Json& b) {
    if (a.is_number_float() && b.is_number_float()) {
      EXPECT_NEAR(a.get<double>(), b.get<double>(), 1e-12 * (1 + std::abs(b.get<double>())));
    } else if (a.is_structured() && b.is_structured() && a.size() == b.size()) {
      for (auto x = a.begin(), y = b.begin(); x != a.end(); ++x, ++y) expect_near(*x, *y);
    } else {
      EXPECT_EQ(a, b);
    }
  }

  std::vector<fs::path> run_shards(uint64_t n) const {
    std::vector<fs::path> parts;
    for (uint64_t shard = 0; shard < n; ++shard) {
      parts.push_back(file(fmt::format("part{}of{}", shard, n)));
      sweep(shard_of(config(parts.back().filename()), shard, n));
    }
    return parts;
  }
};

TEST_F(SweepSummary, EqualSummariesOfTheRecords) {
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
    expect_error([&] { merge_sweeps(parts, file("m")); }, "give the folders of all shards");
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
  // All cases are finished, and the results cannot be moved into place.
  fs::create_directories(file("full") / "run.json" / "in the way");
  expect_error([&] { sweep(config("full")); }, "run.json");
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

TEST_F(SweepSummary, AFullJournalIsMovedToAFileWithoutOtherChanges) {
  sweep(config("whole"));
  const SweepConfig small = [&] {
    SweepConfig of = config("small");
    of.journal_bytes = fs::file_size(file("whole") / summary_file_name) / 4;
    return of;
  }();
  // All cases are finished, and the results cannot be moved into place: the cases moved out of the journal
  // exist.
  const fs::path in_the_way = file("small") / "run.json" / "in the way";
  fs::create_directories(in_the_way);
  expect_error([&] { sweep(small); }, "run.json");
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(file("small") / ".finished")) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  ASSERT_GE(files.size(), 2U);
  EXPECT_LT(fs::file_size(file("small") / "journal.jsonl"), 2 * small.journal_bytes);
  const uint64_t n_first = SummaryReader(files.front()).n_cases();
  const fs::path kept = file("kept");
  fs::remove_all(file("small") / "run.json");
  fs::copy(file("small"), kept, fs::copy_options::recursive);
  const auto resume = [&](uint64_t n_before, const char* what) {
    EXPECT_EQ(sweep(small).n_before, n_before) << what;
    EXPECT_EQ(bytes("small"), bytes("whole")) << what;
    EXPECT_EQ(noise_of("small"), noise_of("whole")) << what;
    EXPECT_FALSE(fs::exists(file("small") / ".finished")) << what;
    fs::remove_all(file("small"));
    fs::copy(kept, file("small"), fs::copy_options::recursive);
  };
  EXPECT_GE(FinishedCases::count(file("small")), files.size());
  resume(12, "whole");
  std::string damaged = read_file(files.front());
  damaged[damaged.size() / 2] ^= 1;
  write_file(files.front(), damaged);
  resume(12 - n_first, "a damaged file");
  write_file(files.front(), damaged.substr(0, damaged.size() / 2));
  resume(12 - n_first, "a file that was cut off");
  write_file(files.front().parent_path() / "next.tmp", "half of it");
  resume(12, "a file that was being made");
}

TEST_F(SweepSummary, AnInterruptedMoveOfTheJournalIsRepeated) {
  sweep(config("whole"));
  SweepConfig small = config("small");
  fs::create_directories(file("small") / "run.json" / "in the way");
  expect_error([&] { sweep(small); }, "run.json");
  const std::string journal = read_file(file("small") / "journal.jsonl");
  small.journal_bytes = 1;
  fs::remove(file("small") / "journal.jsonl");
  expect_error([&] { sweep(small); }, "run.json");
  EXPECT_EQ(fs::file_size(file("small") / "journal.jsonl"), 0U);
  write_file(file("small") / "journal.jsonl", journal);  // killed between the two steps
  fs::remove_all(file("small") / "run.json");
  EXPECT_EQ(sweep(small).n_before, 12U);
  EXPECT_EQ(bytes("small"), bytes("whole"));
  EXPECT_EQ(noise_of("small"), noise_of("whole"));
}

TEST_F(SweepSummary, DamagedFilesAreNamed) {
  const std::vector<fs::path> parts = run_shards(2);
  const fs::path path = parts[1] / summary_file_name;
  const std::string good = read_file(path);
  const auto merging = [&](const std::string& text) {
    write_file(path, text);
    return error_of([&] { merge_sweeps(parts, file("m")); });
  };
  EXPECT_THAT(merging(good.substr(0, good.size() / 2)),
              testing::ContainsRegex("summary.bin: is truncated after [1-5] of 6 cases"));
  EXPECT_THAT(merging(good.substr(0, good.size() - 1)),
              HasSubstr("summary.bin: is truncated after 6 of 6 cases"));
  EXPECT_THAT(merging(good + "x"), HasSubstr("summary.bin: has more bytes than its 6 cases"));
  std::string flipped = good;
  flipped[flipped.size() - 40] ^= 1;
  EXPECT_THAT(merging(flipped), HasSubstr("is damaged: its SHA-256 is not the stored one"));
  EXPECT_THAT(merging("{\"schema\":1}\n"), HasSubstr("not a file of case summaries"));
  EXPECT_THAT(merging(""), HasSubstr("not a file of case summaries"));
  std::string other = good;
  other.replace(other.find("ER_deg"), 6, "ER_rad");
  EXPECT_THAT(merging(other), HasSubstr("sums up the errors"));
  EXPECT_FALSE(fs::exists(file("m")));
  write_file(path, good);
  merge_sweeps(parts, file("m"));
}

TEST_F(SweepSummary, SummariesAndRecordsAreDifferentSweeps) {
  sweep(config("sums"));
  expect_error([&] { sweep(config("sums", KeepOfCases::records)); }, "holds a sweep of another plan");
  expect_error([&] { read_records(file("sums") / "records.jsonl"); }, "\"keep\": \"summary\"");
  std::vector<fs::path> parts = run_shards(2);
  fs::remove_all(parts[1]);
  sweep(shard_of(config("other", KeepOfCases::records), 1, 2));
  parts[1] = file("other");
  expect_error([&] { merge_sweeps(parts, file("m")); }, "another plan");
}

TEST_F(SweepSummary, StatusCountsTheirCases) {
  for (const uint64_t shard : {1, 2}) sweep(shard_of(config(fmt::format("shards/{}", shard)), shard, 3));
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
  expect_error([&] { parse_plan(with("\"sums\""), "p", ""); }, "p:5: keep: unknown value of 'keep' 'sums'");
}

TEST_F(SweepSummary, ManySeedsStandAsARange) {
  const Plan plan =
      parse_plan(plan_text(R"({"level":0,"noise":{}})", R"({"first":7,"count":1000000})"), "p", "");
  EXPECT_EQ(plan.json()["seeds"], (Json{{"first", 7}, {"count", 1000000}}));
  EXPECT_EQ(planned_seeds(plan.json(), "p"), 1000000U);
  EXPECT_EQ(planned_seeds(parse_plan(plan_text(), "p", "").json(), "p"), 3U);
}

}  // namespace
}  // namespace sextant
