#include "sextant/eval/experiment/sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "sextant/base/error.h"
#include "sextant/datasets/codec/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/experiment/procedures.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

/// A small VDO folder, a plan of 12 cases over it and a cache.
class SweepTest : public testing::Test {
 protected:
  SweepTest() {
    VdoFixtureOptions options;
    options.n_frames = 4;
    options.width = 160;
    options.height = 48;
    source_ = make_vdo_fixture(folder_.path() / "vdo", options).source();
  }

  std::string plan_text(const std::string& noise = R"({"parameter":"depth.delta_d_px","levels":[0.1,0.2]})",
                        const std::string& seeds = "3") const {
    return "{\"sources\":[\"" + source_ +
           "\"],\n\"estimators\":[\"motion_only\",\"joint_flow\"],\n\"noise\":" + noise +
           ",\n\"seeds\":" + seeds + "}";
  }

  SweepConfig config(const std::string& out, int jobs = 1) const {
    SweepConfig config;
    config.plan = parse_plan(plan_text(), "plan.json", "");
    config.out = folder_.path() / out;
    config.cache = PackCache(folder_.path() / "cache");
    config.jobs = jobs;
    config.quiet = true;
    return config;
  }

  fs::path file(const std::string& name) const { return folder_.path() / name; }

  /// The name under which the sweep in a folder writes its journal.
  std::string owner(const std::string& out) const {
    return sha256(json_line(read_json(file(out) / "plan.json")));
  }
  static bool any(uint64_t /*number*/, std::string_view /*lines*/) { return true; }

  /// A folder as a killed sweep leaves it, with the blocks that `write` puts into its journal.
  template <typename Write>
  void make_unfinished(const std::string& out, const std::string& plan_of, const Write& write) const {
    fs::remove_all(file(out));
    fs::create_directories(file(out));
    write_file(file(out) / "plan.json", read_file(file(plan_of) / "plan.json"));
    Journal journal(file(out) / "journal.jsonl", owner(out), any);
    write(journal);
  }

  /// The lines of a finished sweep, by case.
  std::map<uint64_t, std::string> lines_of(const std::string& out) const {
    const std::string records = read_file(file(out) / "records.jsonl");
    std::map<uint64_t, std::string> lines;
    size_t at = 0;
    for (const std::string& line : split(read_file(file(out) / "cases.jsonl"), '\n')) {
      if (line.empty()) continue;
      const Json entry = Json::parse(line);
      size_t end = at;
      for (uint64_t n = entry["records"]; n > 0; --n) end = records.find('\n', end) + 1;
      lines[entry["case"]] = records.substr(at, end - at);
      at = end;
    }
    return lines;
  }
  static uint64_t n_lines(const std::string& text) {
    return static_cast<uint64_t>(std::ranges::count(text, '\n'));
  }

  /// The records' bytes without times.
  std::string untimed(const std::string& out) const {
    std::vector<Record> records;
    for (const Record& record : read_records(file(out) / "records.jsonl"))
      records.push_back(strip_times(record));
    return write_records(records);
  }

  TempFolder folder_;
  std::string source_;
};

TEST_F(SweepTest, CasesAreAGrid) {
  const Plan plan = config("a").plan;
  EXPECT_EQ(plan.n_cases(), 12U);
  const PlanCase c = plan.at(10);  // seeds fastest: 10 = ((0 * 2 + 1) * 2 + 1) * 3 + 1
  EXPECT_EQ(c.estimator, 1U);
  EXPECT_EQ(c.level, 1U);
  EXPECT_EQ(c.seed, 1U);
}

TEST_F(SweepTest, RecordsAreThoseOfARunWithTheSameNoise) {
  sweep(config("a"));
  RunConfig run_config;
  run_config.sources = {SourceSpec::parse(source_)};
  run_config.estimator = "joint_flow";
  run_config.noise = Noise::parse(R"({"depth":{"delta_d_px":0.2}})");
  run_config.level = 0.2;
  run_config.n_seeds = 3;
  run_config.quiet = true;
  std::string expected;
  for (const Record& record : run(run_config).records) expected += write_records({strip_times(record)});
  EXPECT_TRUE(untimed("a").ends_with(expected));  // joint_flow at the last level comes last
}

TEST_F(SweepTest, NoiseOnMasksHasItsOwnPacksAndEqualsARun) {
  SweepConfig masks = config("masks");
  const std::string grid =
      R"({"parameter":"mask.erode_px","levels":[0,1,2],"base":{"depth":{"delta_d_px":0.2}}})";
  masks.plan = parse_plan(plan_text(grid, "1"), "plan.json", "");
  sweep(masks);
  EXPECT_EQ(masks.cache.list().size(), 3U);
  RunConfig run_config;
  run_config.sources = {SourceSpec::parse(source_)};
  run_config.estimator = "joint_flow";
  run_config.noise = Noise::parse(R"({"depth":{"delta_d_px":0.2},"mask":{"erode_px":2}})");
  run_config.level = 2;
  run_config.quiet = true;
  std::string expected;
  for (const Record& record : run(run_config).records) expected += write_records({strip_times(record)});
  EXPECT_THAT(expected, testing::HasSubstr("mask"));
  EXPECT_TRUE(untimed("masks").ends_with(expected));
  masks.out = file("masks_without");
  masks.use_packs = false;
  sweep(masks);
  EXPECT_EQ(untimed("masks"), untimed("masks_without"));
  EXPECT_NE(read_records(file("masks") / "records.jsonl").front().n_points, 0);
}

TEST_F(SweepTest, JobsAndPacksDoNotChangeTheRecords) {
  const SweepOutcome outcome = sweep(config("a"));
  EXPECT_EQ(outcome.n_cases, 12U);
  EXPECT_EQ(outcome.n_before, 0U);
  sweep(config("b", 3));
  SweepConfig without = config("c");
  without.use_packs = false;
  sweep(without);
  EXPECT_EQ(untimed("a"), untimed("b"));
  EXPECT_EQ(untimed("a"), untimed("c"));
  EXPECT_FALSE(fs::exists(file("a") / "journal.jsonl"));
  EXPECT_EQ(sweep(config("a")).n_before, 12U);  // nothing is left to do
}

TEST_F(SweepTest, ShardsMergeToTheWhole) {
  sweep(config("whole"));
  for (uint64_t shard = 1; shard <= 5; ++shard) {  // 5 does not divide 12
    SweepConfig part = config(fmt::format("part{}", shard));
    part.shard = shard;
    part.n_shards = 5;
    sweep(part);
  }
  const auto parts = [&](std::vector<int> numbers) {
    std::vector<fs::path> folders;
    for (const int number : numbers) folders.push_back(file(fmt::format("part{}", number)));
    return folders;
  };
  EXPECT_EQ(merge_sweeps(parts({3, 1, 5, 2, 4}), file("merged")).n_cases, 12U);
  EXPECT_EQ(untimed("merged"), untimed("whole"));
  expect_error([&] { merge_sweeps(parts({1, 2, 3, 4}), file("m2")); }, "a shard is missing");
  expect_error([&] { merge_sweeps(parts({1, 2, 3, 4, 5, 2}), file("m2")); }, "give each shard once");
  SweepConfig other = config("other");
  other.plan = parse_plan(plan_text(R"({"parameter":"depth.delta_d_px","levels":[0.1,0.3]})"), "p", "");
  sweep(other);
  expect_error([&] { merge_sweeps({file("part1"), file("other")}, file("m2")); }, "holds another plan");
}

TEST_F(SweepTest, ResumesFromAnyCutOfTheJournal) {
  sweep(config("whole"));
  make_unfinished("full", "whole", [&](Journal& journal) {  // of all cases, as it is before the end
    for (const auto& [number, lines] : lines_of("whole")) journal.append(number, n_lines(lines), lines);
  });
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
    EXPECT_EQ(untimed("cut"), untimed("whole")) << cut;
  }
}

TEST_F(SweepTest, ADamagedBlockIsDoneAgain) {
  fs::create_directories(file("j"));
  const fs::path path = file("j") / "journal.jsonl";
  {
    Journal journal(path, "sweep", any);
    journal.append(4, 1, "{\"a\":1}\n");
    journal.append(2, 2, "{\"b\":1}\n{\"b\":2}\n");
    EXPECT_EQ(journal.ordered_lines(), "{\"b\":1}\n{\"b\":2}\n{\"a\":1}\n");
    expect_error([&] { Journal second(path, "sweep", any); }, "another sweep is writing here");
  }
  std::string bytes = read_file(path);
  bytes[bytes.size() - 3] = '7';
  write_file(path, bytes);
  const Journal journal(path, "sweep", any);
  EXPECT_EQ(journal.blocks().size(), 1U);
  EXPECT_TRUE(journal.blocks().contains(4));
}

TEST_F(SweepTest, ABlockOfAnotherCaseIsDoneAgain) {
  sweep(config("whole"));
  const std::map<uint64_t, std::string> lines = lines_of("whole");
  make_unfinished("replaced", "whole", [&](Journal& journal) {
    journal.append(3, n_lines(lines.at(4)), lines.at(4));  // its sum is right, its seed is not
    journal.append(2, n_lines(lines.at(2)), lines.at(2));
    journal.append(77, n_lines(lines.at(5)), lines.at(5));  // there is no such case
    journal.append(6, 1, "no record\n");
  });
  const SweepOutcome outcome = sweep(config("replaced"));
  EXPECT_EQ(outcome.n_before, 1U);
  EXPECT_EQ(untimed("replaced"), untimed("whole"));
  EXPECT_EQ(n_lines(read_file(file("replaced") / "cases.jsonl")), 12U);
}

TEST_F(SweepTest, ABlockOfAnotherSweepIsDoneAgain) {
  sweep(config("whole"));
  SweepConfig other = config("other");
  std::string text = plan_text();
  text.insert(text.size() - 1, R"(,"options":{"pipeline":{"min_object_points":7}})");
  other.plan = parse_plan(text, "plan.json", "");
  sweep(other);
  // Same cases, same keys in every record, other results.
  make_unfinished("foreign", "other", [&](Journal& journal) {
    for (const auto& [number, lines] : lines_of("other")) journal.append(number, n_lines(lines), lines);
  });
  write_file(file("foreign") / "plan.json", read_file(file("whole") / "plan.json"));
  EXPECT_EQ(sweep(config("foreign")).n_before, 0U);
  EXPECT_EQ(untimed("foreign"), untimed("whole"));
  // A header under another number.
  make_unfinished("moved", "whole", [&](Journal& journal) {
    for (const auto& [number, lines] : lines_of("whole")) journal.append(number, n_lines(lines), lines);
  });
  std::string bytes = read_file(file("moved") / "journal.jsonl");
  bytes.replace(bytes.find("\"case\":5,"), 9, "\"case\":3,");
  write_file(file("moved") / "journal.jsonl", bytes);
  EXPECT_EQ(sweep(config("moved")).n_before, 5U);
  EXPECT_EQ(untimed("moved"), untimed("whole"));
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
  SweepConfig part = config("a");
  part.n_shards = 2;
  expect_error([&] { sweep(part); }, "another shard");
  fs::copy_file(file("vdo/depth/000000.png"), file("vdo/depth/000001.png"),
                fs::copy_options::overwrite_existing);
  expect_error([&] { sweep(config("a")); }, "data that have changed");
}

// A file size limit makes write() fail as a full disk does.
TEST_F(SweepTest, AFullDiskLosesNothing) {
  sweep(config("whole"));
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlim_t limit = fs::file_size(file("whole") / "records.jsonl") / 2;
    const rlimit small{limit, limit};
    ::setrlimit(RLIMIT_FSIZE, &small);
    try {
      sweep(config("full"));
    } catch (const Error& error) {
      ::_exit(std::string(error.what()).find("cases are safe") != std::string::npos ? 3 : 4);
    }
    ::_exit(5);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  const SweepOutcome outcome = sweep(config("full"));
  EXPECT_GT(outcome.n_before, 2U);
  EXPECT_LT(outcome.n_before, 12U);
  EXPECT_EQ(untimed("full"), untimed("whole"));
}

TEST_F(SweepTest, EstimateCountsWithoutRunning) {
  const SweepEstimate estimate = estimate_sweep(config("none"));
  EXPECT_EQ(estimate.n_cases, 12U);
  EXPECT_EQ(estimate.n_pairs, 36U);
  EXPECT_GT(estimate.seconds, 0);
  EXPECT_FALSE(fs::exists(file("none")));
}

TEST_F(SweepTest, BadPlansNameLineAndKey) {
  const auto parse = [&](const std::string& text) { parse_plan(text, "p.json", ""); };
  const auto noisy = [&](const std::string& noise) { parse(plan_text(noise)); };
  expect_error([&] { parse("{\"sources\":\n[}"); }, "p.json:2: not valid JSON");
  expect_error([&] { parse("[]"); }, "p.json:1: expected an object");
  expect_error([&] { parse("{\"sources\":[],\n\"estimators\":[\"joint_flow\"]}"); }, "p.json:1: sources");
  expect_error([&] { parse("{\n\"estimators\":[\"joint_flow\"]}"); }, "key 'sources' is missing");
  expect_error([&] { parse("{\"sources\":[\"vdo:/no/such\"],\n\"estimators\":[\"joint_flow\"]}"); },
               "'vdo:/no/such'");
  expect_error([&] { noisy(R"({"parameter":"depth.delta","levels":[1]})"); }, "p.json:3: noise");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_px","levels":[1]})"); }, "did you mean 'delta_d_px'");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_d_px","levels":[]})"); }, "list that is not empty");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_d_px","levels":[0.1,-0.2]})"); }, "got -0.2");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_d_px","levels":[0.1,0.1]})"); }, "there twice");
  expect_error([&] { parse(plan_text("{\"level\":1}", "1000000000")); }, "more than 10000000 cases");
  expect_error([&] { parse(plan_text("{\"level\":1}", "[1,1]")); }, "p.json:4: seeds");
  expect_error([&] { parse(plan_text("{\"level\":1}", "0")); }, "there are none");
  expect_error([&] { parse(plan_text("{\"level\":1}", R"({"first":18446744073709551610,"count":7})")); },
               "p.json:4: seeds: key 'first': 18446744073709551610 and the 6 seeds after it go beyond");
  EXPECT_EQ(parse_plan(plan_text("{\"level\":1}", R"({"first":18446744073709551610,"count":6})"), "p", "")
                .seeds.back(),
            18446744073709551615U);
  expect_error([&] { parse(plan_text("{\"level\":1e400}")); }, "p.json:3: the number 1e400");
  expect_error([&] { parse(plan_text("[[[[\"" + std::string(20, 'x') + "\"]]]]")); }, "p.json:3: noise");
  expect_error(
      [&] { parse("{\"sources\":[{\"source\":\"synthetic:s18\",\"options\":3}],\n\"estimators\":[]}"); },
      "option source: expected an object");
  expect_error([&] { parse(plan_text("{\"level\":1}", "1,\"options\":{\"pipeline\":[]}")); },
               "expected an object");
  std::string text = plan_text();
  text.insert(1, "\"optoins\":{},");
  expect_error([&] { parse(text); }, "p.json:1: unknown key 'optoins': did you mean 'options'");
  text = plan_text();
  text.insert(text.size() - 1, ",\n\"options\":{\"pipeline\":{\n\"min_object_aera\":1}}");
  expect_error([&] { parse(text); }, "p.json:6: options: unknown option key 'pipeline.min_object_aera'");
}

TEST_F(SweepTest, AnEstimatorMayHaveAFrontEndOfItsOwn) {
  const std::string text =
      "{\"sources\":[\"" + source_ + R"("],"options":{"pipeline":{"min_object_points":40}},
      "estimators":["joint_flow",
        {"name":"joint_flow","label":"coarse","extraction":{"object_step_px":6},"pipeline":{"refine_on":"all"}}]})";
  SweepConfig sweep_config = config("own");
  sweep_config.plan = parse_plan(text, "plan.json", "");
  ASSERT_EQ(sweep_config.plan.estimators.size(), 2U);
  EXPECT_EQ(sweep_config.plan.estimators[1].pipeline.min_object_points, 40);
  EXPECT_EQ(sweep_config.plan.estimators[1].pipeline.refine_on, "all");
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

TEST_F(SweepTest, AProcedureFillsInWhatThePlanDoesNotSay) {
  const auto plan = [&](const std::string& more) {
    return parse_plan("{\"sources\":[\"" + source_ + "\"],\"procedure\":\"paper_release\"" + more + "}",
                      "plan.json", "");
  };
  const Plan as_published = plan("");
  ASSERT_EQ(as_published.estimators.size(), 2U);
  EXPECT_EQ(as_published.estimators[0].label, "motion_only, release");
  EXPECT_EQ(as_published.estimators[0].pipeline.refine_on, "inliers");
  EXPECT_EQ(as_published.estimators[1].pipeline.refine_objects_on, "inliers");
  EXPECT_EQ(as_published.pipeline.start.inlier_threshold_px, 0.3);
  EXPECT_EQ(as_published.levels.front().level, 0.15);
  const Plan wider = plan(R"(,"options":{"pipeline":{"start":{"inlier_threshold_px":2}}})");
  EXPECT_EQ(wider.pipeline.start.inlier_threshold_px, 2);
  EXPECT_EQ(wider.pipeline.start.confidence, 0.98);
  EXPECT_THROW(
      parse_plan("{\"sources\":[\"" + source_ + "\"],\"procedure\":\"paper_relase\"}", "plan.json", ""),
      Error);
}

TEST(Procedures, EachIsAPlanAndSaysWhatItFollows) {
  ASSERT_FALSE(procedure_names().empty());
  for (const std::string& name : procedure_names()) {
    EXPECT_GT(find_procedure(name).at("description").get<std::string>().size(), 40U) << name;
    for (const char* estimator : {"motion_only", "joint_flow"}) {
      const ResolvedOptions options = resolve_options(procedure_options(name, estimator));
      make_case_estimator(estimator, options.estimator);
      EXPECT_EQ(options.pipeline.start.inlier_threshold_px, 0.3) << name;
    }
    EXPECT_THROW(procedure_options(name, "joint_flow_depth"), Error);
  }
}

}  // namespace
}  // namespace sextant
