#include "sextant/eval/experiment/sweep.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "sextant/eval/experiment/plan_testing.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

class SweepTest : public SmallPlan {
 protected:
  /// Returns the owner of the journal of the sweep in a folder.
  std::string owner(const std::string& out) const {
    Json plan = read_json(file(out) / "plan.json");
    plan.erase("programs");
    return sha256(json_line(plan));
  }
  static bool any(uint64_t /*number*/, std::string_view /*lines*/) { return true; }

  /// Makes a folder as a killed sweep leaves it, with the blocks that `write` appends to its journal.
  template <typename Write>
  void make_unfinished(const std::string& out, const std::string& plan_of, const Write& write) const {
    fs::remove_all(file(out));
    fs::create_directories(file(out));
    write_file(file(out) / "plan.json", read_file(file(plan_of) / "plan.json"));
    Journal journal(file(out) / "journal.jsonl", owner(out), any);
    write(journal);
  }

  static uint64_t n_lines(const std::string& text) {
    return static_cast<uint64_t>(std::ranges::count(text, '\n'));
  }
  struct Case {
    std::string lines;
    Json noise;
    void append(Journal& journal, uint64_t number) const {
      journal.append(number, n_lines(lines), lines, noise);
    }
  };
  /// Returns the cases of a finished sweep.
  std::map<uint64_t, Case> cases_of(const std::string& out) const {
    const std::string records = read_file(file(out) / "records.jsonl");
    std::map<uint64_t, Case> cases;
    size_t at = 0;
    for (const std::string& line : split(read_file(file(out) / "cases.jsonl"), '\n')) {
      if (line.empty()) continue;
      const Json entry = Json::parse(line);
      size_t end = at;
      for (uint64_t n = entry["records"]; n > 0; --n) end = records.find('\n', end) + 1;
      cases[entry["case"]] = {records.substr(at, end - at), entry["noise"]};
      at = end;
    }
    return cases;
  }
  /// Returns a function that writes all cases into a journal.
  auto all_cases_of(const std::string& out) const {
    return [cases = cases_of(out)](Journal& journal) {
      for (const auto& [number, done] : cases) done.append(journal, number);
    };
  }

  /// Returns the records' bytes without times.
  std::string untimed_bytes(const std::string& out) const {
    return write_records(untimed(read_records(file(out) / "records.jsonl")));
  }

  /// Expects that joint_flow at the last level of `plan` equals the result of run(): records and achieved
  /// noise.
  void expect_run_of_last_level(const std::string& out, const Plan& plan) const {
    RunConfig run_config;
    run_config.sources = plan.sources;
    run_config.estimator = "joint_flow";
    run_config.noise = plan.levels.back().noise;
    run_config.level = plan.levels.back().level;
    run_config.n_seeds = static_cast<int>(plan.seeds.size());
    run_config.quiet = true;
    const RunResult result = run(run_config);
    EXPECT_TRUE(untimed_bytes(out).ends_with(write_records(untimed(result.records))));
    EXPECT_EQ(noise_of(out).back()["noise"], result.sources.front().noise);
  }
};

TEST_F(SweepTest, RecordsAndNoiseAreThoseOfARunWithTheSameNoise) {
  sweep(config("a"));
  expect_run_of_last_level("a", config("a").plan);
}

TEST_F(SweepTest, NoiseOnMasksHasItsOwnPacksAndEqualsARun) {
  SweepConfig masks = config("masks");
  const std::string grid =
      R"({"parameter":"mask.erode_px","levels":[0,1,2],"base":{"depth":{"delta_d_px":0.2}}})";
  masks.plan = parse_plan(plan_text(grid, "1"), "plan.json", "");
  sweep(masks);
  EXPECT_EQ(masks.cache.list().size(), 3U);
  EXPECT_THAT(untimed_bytes("masks"), HasSubstr("mask"));
  expect_run_of_last_level("masks", masks.plan);
  masks.out = file("masks_without");
  masks.use_packs = false;
  sweep(masks);
  EXPECT_EQ(untimed_bytes("masks"), untimed_bytes("masks_without"));
  EXPECT_NE(read_records(file("masks") / "records.jsonl").front().n_points, 0);
}

// Two estimators with the same points have the same noise; a third one uses fewer points.
TEST_F(SweepTest, SharedNoiseIsCountedOnce) {
  const auto noise_with = [&](const std::string& out, const std::string& estimators) {
    SweepConfig c = config(out);
    c.plan = parse_plan("{\"sources\":[\"" + source_ + "\"],\"estimators\":[" + estimators +
                            R"(],"noise":{"level":1,"noise":{"depth":{"delta_d_px":0.2}}},"seeds":2})",
                        "plan.json", "");
    sweep(c);
    return noise_of(out);
  };
  const std::string coarse = R"({"name":"joint_flow","label":"coarse","extraction":{"object_step_px":6}})";
  const Json one = noise_with("one", "\"motion_only\"");
  EXPECT_EQ(noise_with("two", "\"motion_only\",\"joint_flow\""), one);
  const uint64_t n_one = one[0]["noise"]["depth"]["n"];
  const uint64_t n_coarse = noise_with("coarse", coarse)[0]["noise"]["depth"]["n"];
  EXPECT_LT(n_coarse, n_one);
  EXPECT_EQ(noise_with("three", "\"motion_only\",\"joint_flow\"," + coarse)[0]["noise"]["depth"]["n"],
            n_one + n_coarse);
}

TEST_F(SweepTest, JobsAndPacksDoNotChangeTheRecords) {
  const SweepOutcome outcome = sweep(config("a"));
  EXPECT_EQ(outcome.n_cases, 12U);
  EXPECT_EQ(outcome.n_before, 0U);
  SweepConfig three = config("b");
  three.jobs = 3;
  sweep(three);
  SweepConfig without = config("c");
  without.use_packs = false;
  sweep(without);
  EXPECT_EQ(untimed_bytes("a"), untimed_bytes("b"));
  EXPECT_EQ(untimed_bytes("a"), untimed_bytes("c"));
  EXPECT_EQ(noise_of("a"), noise_of("b"));
  EXPECT_EQ(noise_of("a"), noise_of("c"));
  EXPECT_FALSE(fs::exists(file("a") / "journal.jsonl"));
  EXPECT_EQ(sweep(config("a")).n_before, 12U);  // nothing is left to do
}

TEST_F(SweepTest, ShardsMergeToTheWhole) {
  sweep(config("whole"));
  for (uint64_t shard = 1; shard <= 5; ++shard) {  // 5 does not divide 12
    sweep(shard_of(config(fmt::format("part{}", shard)), shard, 5));
  }
  const auto parts = [&](std::vector<int> numbers) {
    std::vector<fs::path> folders;
    for (const int number : numbers) folders.push_back(file(fmt::format("part{}", number)));
    return folders;
  };
  EXPECT_EQ(merge_sweeps(parts({3, 1, 5, 2, 4}), file("merged")).n_cases, 12U);
  EXPECT_EQ(untimed_bytes("merged"), untimed_bytes("whole"));
  EXPECT_EQ(noise_of("merged"), noise_of("whole"));
  EXPECT_LT(noise_of("part1")[0]["noise"]["depth"]["n"], noise_of("whole")[0]["noise"]["depth"]["n"]);
  expect_error([&] { merge_sweeps(parts({1, 2, 3, 4}), file("m2")); }, "give the folders of all shards");
  expect_error([&] { merge_sweeps(parts({1, 2, 3, 4, 5, 2}), file("m2")); }, "list each shard once");
  SweepConfig other = config("other");
  other.plan = parse_plan(plan_text(R"({"parameter":"depth.delta_d_px","levels":[0.1,0.3]})"), "p", "");
  sweep(other);
  expect_error([&] { merge_sweeps({file("part1"), file("other")}, file("m2")); }, "holds another plan");
}

TEST_F(SweepTest, ResumesFromAnyCutOfTheJournal) {
  sweep(config("whole"));
  make_unfinished("full", "whole", all_cases_of("whole"));  // the state before the end
  const std::string journal = read_file(file("full") / "journal.jsonl");
  const std::string plan = read_file(file("whole") / "plan.json");
  for (const size_t cut :
       {size_t{0}, size_t{1}, journal.size() / 3, journal.size() / 2, journal.size() - 1}) {
    fs::remove_all(file("cut"));
    fs::create_directories(file("cut"));
    write_file(file("cut") / "plan.json", plan);
    write_file(file("cut") / "journal.jsonl", std::string_view(journal).substr(0, cut));
    const SweepOutcome outcome = sweep(config("cut"));
    EXPECT_LT(outcome.n_before, 12U);
    EXPECT_EQ(outcome.n_before > 0, cut > journal.size() / 4) << cut;
    EXPECT_EQ(untimed_bytes("cut"), untimed_bytes("whole")) << cut;
    EXPECT_EQ(noise_of("cut"), noise_of("whole")) << cut;
  }
}

TEST_F(SweepTest, ADamagedBlockIsDoneAgain) {
  fs::create_directories(file("j"));
  const fs::path path = file("j") / "journal.jsonl";
  {
    Journal journal(path, "sweep", any);
    journal.append(4, 1, "{\"a\":1}\n");
    journal.append(2, 2, "{\"b\":1}\n{\"b\":2}\n");
    EXPECT_EQ(journal.content(journal.blocks().at(4)), "{\"a\":1}\n");
    EXPECT_EQ(journal.content(journal.blocks().at(2)), "{\"b\":1}\n{\"b\":2}\n");
    expect_error([&] { Journal second(path, "sweep", any); }, "another process is writing this sweep");
  }
  std::string bytes = read_file(path);
  bytes[bytes.size() - 3] = '7';
  write_file(path, bytes);
  const Journal journal(path, "sweep", any);
  EXPECT_EQ(journal.blocks().size(), 1U);
  EXPECT_TRUE(journal.blocks().contains(4));
}

TEST_F(SweepTest, AJournalThatIsALinkIsAnError) {
  fs::create_directories(file("linked"));
  write_file(file("precious"), "not a block\n");
  fs::create_symlink(file("precious"), file("linked") / "journal.jsonl");
  expect_error([&] { Journal journal(file("linked") / "journal.jsonl", "sweep", any); }, "is a link");
  EXPECT_EQ(read_file(file("precious")), "not a block\n");
}

TEST_F(SweepTest, ABlockOfAnotherCaseIsDoneAgain) {
  sweep(config("whole"));
  const std::map<uint64_t, Case> cases = cases_of("whole");
  make_unfinished("replaced", "whole", [&](Journal& journal) {
    cases.at(4).append(journal, 3);  // its checksum is right, its seed is not
    cases.at(2).append(journal, 2);
    cases.at(5).append(journal, 77);  // there is no such case
    journal.append(6, 1, "no record\n");
  });
  const SweepOutcome outcome = sweep(config("replaced"));
  EXPECT_EQ(outcome.n_before, 1U);
  EXPECT_EQ(untimed_bytes("replaced"), untimed_bytes("whole"));
  EXPECT_EQ(n_lines(read_file(file("replaced") / "cases.jsonl")), 12U);
}

TEST_F(SweepTest, ABlockOfAnotherSweepIsDoneAgain) {
  sweep(config("whole"));
  SweepConfig other = config("other");
  std::string text = plan_text();
  text.insert(text.size() - 1, R"(,"options":{"pipeline":{"min_object_points":7}})");
  other.plan = parse_plan(text, "plan.json", "");
  sweep(other);
  // Same cases and keys in every record, but other results.
  make_unfinished("foreign", "other", all_cases_of("other"));
  write_file(file("foreign") / "plan.json", read_file(file("whole") / "plan.json"));
  EXPECT_EQ(sweep(config("foreign")).n_before, 0U);
  EXPECT_EQ(untimed_bytes("foreign"), untimed_bytes("whole"));
  // A header with another number.
  make_unfinished("moved", "whole", all_cases_of("whole"));
  std::string bytes = read_file(file("moved") / "journal.jsonl");
  bytes.replace(bytes.find("\"case\":5,"), 9, "\"case\":3,");
  write_file(file("moved") / "journal.jsonl", bytes);
  EXPECT_EQ(sweep(config("moved")).n_before, 5U);
  EXPECT_EQ(untimed_bytes("moved"), untimed_bytes("whole"));
}

TEST_F(SweepTest, DamagedFilesOfASweepAreNamed) {
  sweep(config("a"));
  const std::string index = read_file(file("a") / "cases.jsonl");
  const auto merge_with = [&](const std::string& text) {
    write_file(file("a") / "cases.jsonl", text);
    return [&] { merge_sweeps({file("a")}, file("m")); };
  };
  expect_error(merge_with("{\"case\":0,\"records\":3}\n{\"case\":1e400}\n"),
               "cases.jsonl:2: the number 1e400");
  expect_error(merge_with("{\"case\":0,\"records\":\"3\"}\n"),
               "cases.jsonl:1: key 'records': expected a non-neg");
  expect_error(merge_with("{\"case\":-1,\"records\":3}\n"), "cases.jsonl:1: key 'case'");
  write_file(file("a") / "cases.jsonl", index);
  write_file(file("a") / "run.json", "{\n\"cases\": \"many\"}");
  expect_error([&] { merge_sweeps({file("a")}, file("m")); }, "run.json: key 'cases'");
  write_file(file("a") / "plan.json", std::string(200000, '['));
  expect_error([&] { sweep(config("a")); }, "plan.json:1: more than 100 levels");
}

TEST_F(SweepTest, AFolderOfAnotherSweepIsRefused) {
  sweep(config("a"));
  SweepConfig other = config("a");
  other.plan = parse_plan(plan_text(R"({"parameter":"depth.delta_d_px","levels":[0.1]})"), "p", "");
  expect_error([&] { sweep(other); }, "holds a sweep of another plan");
  expect_error([&] { sweep(shard_of(config("a"), 0, 2)); }, "another shard");
  fs::copy_file(file("vdo/depth/000000.png"), file("vdo/depth/000001.png"),
                fs::copy_options::overwrite_existing);
  expect_error([&] { sweep(config("a")); }, "data that have changed");
}

// Changes the folder as if an older program had made or begun the shard.
void set_program(const fs::path& folder, const std::string& version) {
  Json plan = read_json(folder / "plan.json");
  plan["programs"] = {{{"version", version}, {"git_commit", "abc"}}};
  write_file(folder / "plan.json", json_text(plan));
}

TEST_F(SweepTest, RecordsOfOneSweepComeFromOneVersion) {
  sweep(shard_of(config("part1"), 0, 2));
  sweep(shard_of(config("part2"), 1, 2));
  set_program(file("part2"), "0.0.9");
  const std::vector<fs::path> parts = {file("part1"), file("part2")};
  expect_error([&] { merge_sweeps(parts, file("m")); }, "was made by Sextant 0.0.9 (commit abc)");
  EXPECT_FALSE(fs::exists(file("m")));
  merge_sweeps(parts, file("m"), /*allow_mixed=*/true);
  EXPECT_EQ(read_json(file("m") / "run.json")["programs"].size(), 2U);
  EXPECT_EQ(read_json(file("m") / "run.json")["shards"].size(), 2U);

  make_unfinished("begun", "part1", [](Journal&) {});
  set_program(file("begun"), "0.0.9");
  SweepConfig resumed = shard_of(config("begun"), 0, 2);
  expect_error([&] { sweep(resumed); }, "was begun by Sextant 0.0.9 (commit abc)");
  resumed.allow_mixed = true;
  sweep(resumed);
  EXPECT_EQ(untimed_bytes("begun"), untimed_bytes("part1"));
  EXPECT_EQ(read_json(file("begun") / "run.json")["programs"].size(), 2U);
}

TEST_F(SweepTest, ShardsOfOtherDefinitionsAreNotMerged) {
  sweep(shard_of(config("part1"), 0, 2));
  sweep(shard_of(config("part2"), 1, 2));
  Json run = read_json(file("part2") / "run.json");
  run["metric_definitions"]["Et_m"] = "2: in mm";
  write_file(file("part2") / "run.json", json_text(run));
  const std::vector<fs::path> parts = {file("part1"), file("part2")};
  expect_error([&] { merge_sweeps(parts, file("m"), /*allow_mixed=*/true); }, "Et_m is defined as");
}

TEST_F(SweepTest, AFinishedSweepWhoseRecordsWereCutOffIsRefused) {
  sweep(config("a"));
  const std::string records = read_file(file("a") / "records.jsonl");
  write_file(file("a") / "records.jsonl", records.substr(0, records.find('\n') + 1));
  expect_error([&] { sweep(config("a")); }, "records.jsonl holds 1 records, but run.json states");
}

// A file size limit makes write() fail like a full disk.
TEST_F(SweepTest, AFullDiskLosesNoFinishedCase) {
  sweep(config("whole"));
  const int status = status_of_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlim_t limit = fs::file_size(file("whole") / "records.jsonl") / 2;
    const rlimit small{limit, limit};
    ::setrlimit(RLIMIT_FSIZE, &small);
    try {
      sweep(config("full"));
    } catch (const Error& error) {
      return std::string(error.what()).find("cases are safe") != std::string::npos ? 3 : 4;
    }
    return 5;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  const SweepOutcome outcome = sweep(config("full"));
  EXPECT_GT(outcome.n_before, 2U);
  EXPECT_LT(outcome.n_before, 12U);
  EXPECT_EQ(untimed_bytes("full"), untimed_bytes("whole"));
}

TEST_F(SweepTest, SizeCountsWithoutRunning) {
  const SweepSize size = size_of_sweep(config("none"));
  EXPECT_EQ(size.n_cases, 12U);
  EXPECT_EQ(size.n_pairs, 36U);
  EXPECT_FALSE(fs::exists(file("none")));
}

TEST_F(SweepTest, AnEstimatorMayHaveAFrontEndOfItsOwn) {
  const std::string text =
      "{\"sources\":[\"" + source_ + R"("],"options":{"pipeline":{"min_object_points":40}},
      "estimators":["joint_flow",
        {"name":"joint_flow","label":"coarse","extraction":{"object_step_px":6},
         "pipeline":{"refine_on":"all"}}]})";
  SweepConfig sweep_config = config("own");
  sweep_config.plan = parse_plan(text, "plan.json", "");
  ASSERT_EQ(sweep_config.plan.estimators.size(), 2U);
  EXPECT_EQ(sweep_config.plan.estimators[1].pipeline.min_object_points, 40);
  EXPECT_EQ(sweep_config.plan.estimators[1].pipeline.refine_on, RefineOn::all);
  EXPECT_EQ(sweep_config.plan.estimators[0].pipeline.refine_on, PipelineOptions{}.refine_on);
  const Json written = sweep_config.plan.json();
  EXPECT_FALSE(written["estimators"][0].contains("extraction"));
  EXPECT_EQ(written["estimators"][1]["extraction"]["object_step_px"], 6);
  sweep(sweep_config);
  std::map<std::string, int> points;
  for (const Record& r : read_records(file("own") / "records.jsonl")) {
    if (!r.is_ego()) points[r.estimator] += r.n_points;
  }
  EXPECT_GT(points["joint_flow"], 3 * points["coarse"]);
  EXPECT_THROW(parse_plan("{\"sources\":[\"" + source_ +
                              R"("],"estimators":[{"name":"joint_flow","pipeline":{"refine":"all"}}]})",
                          "plan.json", ""),
               Error);
}

}  // namespace
}  // namespace sextant
