// Sweeps whose external estimator has changed since an earlier run.

#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/external/external_testing.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

class StaleCasesTest : public ExternalEstimatorTest {
 protected:
  StaleCasesTest() {
    write_camera();
    write_camera("other_camera.txt", 1);
  }

  static constexpr const char* good = "cp $(dirname $0)/camera.txt $output";
  static constexpr const char* worse = "tail -n 4 $(dirname $0)/camera.txt > $output/camera.txt";

  std::string untimed_bytes(const std::string& out) const {
    return write_records(untimed(read_records(file(out) / "records.jsonl")));
  }
  SweepConfig config_of(const std::string& out, const std::string& estimator) {
    SweepConfig c = sweep_config(out, estimator);
    c.on_message = [this](const std::string& line) { messages_.push_back(line); };
    return c;
  }
  SweepOutcome sweep_into(const std::string& out, const std::string& estimator) {
    messages_.clear();
    return sweep(config_of(out, estimator));
  }
  Fingerprints of(const std::string& out, const char* name = "run.json") const {
    return fingerprints_in(read_json(file(out) / name), name);
  }
  std::map<std::string, std::string> all_bytes(const std::string& out) const {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::recursive_directory_iterator(file(out))) {
      if (entry.is_regular_file()) bytes[entry.path().string()] = read_file(entry.path());
    }
    return bytes;
  }
  /// Expects that the sweep in `out` equals one in a new folder.
  void expect_as_new(const std::string& out, const std::string& estimator) {
    sweep(config_of("new_" + out, estimator));
    EXPECT_EQ(untimed_bytes(out), untimed_bytes("new_" + out));
    EXPECT_EQ(of(out), of("new_" + out));
    EXPECT_EQ(of(out, "plan.json"), of(out));
  }

  std::vector<std::string> messages_;
};

TEST_F(StaleCasesTest, AnUnchangedProgramIsNotRunAgain) {
  const fs::path count = file(".count");
  const std::string estimator = config(std::string(good) + "; echo x >> $(dirname $0)/.count");
  sweep_into("a", estimator);
  const auto bytes = all_bytes("a");
  EXPECT_EQ(fs::file_size(count), 12U);  // 6 cases, one line each
  const SweepOutcome again = sweep_into("a", estimator);
  EXPECT_EQ(again.n_before, 12U);
  EXPECT_EQ(again.n_stale, 0U);
  EXPECT_THAT(messages_, IsEmpty());
  EXPECT_EQ(all_bytes("a"), bytes);
  EXPECT_EQ(fs::file_size(count), 12U);
}

TEST_F(StaleCasesTest, AChangedScriptIsRunAgain) {
  sweep_into("a", config(good));
  const std::string estimator = config(worse);
  const SweepOutcome outcome = sweep_into("a", estimator);
  EXPECT_EQ(outcome.n_before, 6U);  // those of motion_only
  EXPECT_EQ(outcome.n_stale, 6U);
  ASSERT_EQ(messages_.size(), 1U);
  EXPECT_THAT(
      messages_[0],
      HasSubstr("'program': another version of it made 6 finished cases (program.sh changed): run again"));
  expect_as_new("a", estimator);
  EXPECT_EQ(sweep_into("a", estimator).n_before, 12U);
}

TEST_F(StaleCasesTest, AChangedConfigurationIsRunAgain) {
  sweep_into("a", config(good));
  const std::string estimator = config(good, {{"camera", {{"inverse", true}}}});
  EXPECT_EQ(sweep_into("a", estimator).n_stale, 6U);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("(configuration changed)")));
  expect_as_new("a", estimator);
  // and of a plan
  SweepConfig by_plan =
      sweep_config("a", {{"name", estimator}, {"options", {{"camera", {{"inverse", false}}}}}});
  EXPECT_EQ(sweep(by_plan).n_stale, 6U);
}

TEST_F(StaleCasesTest, FilesNamedOnlyInDependsAreSeen) {
  fs::create_directories(file("elsewhere"));
  fs::rename(file("other_camera.txt"), file("elsewhere/one.txt"));
  write_file(file("elsewhere/camera.txt"), read_file(file("camera.txt")));
  const std::string script = "cp $(dirname $0)/elsewhere/camera.txt $output";
  const std::string estimator = config(script, {{"depends", {"elsewhere/*.txt"}}});
  sweep_into("a", estimator);
  EXPECT_EQ(sweep_into("a", estimator).n_stale, 0U);
  write_file(file("elsewhere/camera.txt"), read_file(file("elsewhere/one.txt")));
  EXPECT_EQ(sweep_into("a", estimator).n_stale, 6U);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("(elsewhere/camera.txt changed)")));
  expect_as_new("a", estimator);
}

TEST_F(StaleCasesTest, StaleCasesAreKeptWhereAsked) {
  sweep_into("a", config(good));
  const auto bytes = all_bytes("a");
  const std::string estimator = config(worse);
  SweepConfig c = config_of("a", estimator);
  c.reuse_stale = true;
  const SweepOutcome outcome = sweep(c);
  EXPECT_EQ(outcome.n_before, 12U);
  EXPECT_EQ(outcome.n_stale, 6U);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("kept, as --reuse-stale says")));
  EXPECT_EQ(all_bytes("a"), bytes);
  EXPECT_EQ(sweep_into("a", estimator).n_stale, 6U);  // they are still stale
  expect_as_new("a", estimator);
}

TEST_F(StaleCasesTest, ForceStartsOver) {
  const std::string estimator = config(good);
  sweep_into("a", estimator);
  SweepConfig c = config_of("a", estimator);
  c.force = true;
  EXPECT_EQ(sweep(c).n_before, 0U);
  EXPECT_THAT(messages_, IsEmpty());
  SweepConfig other = sweep_config("a", estimator, 1);  // another plan
  expect_error([&] { sweep(other); }, "--force to start over");
  other.force = true;
  EXPECT_EQ(sweep(other).n_cases, 4U);
  EXPECT_FALSE(fs::exists(file("a/external/case_000005")));
  fs::create_directories(file("b"));
  write_file(file("b/records.jsonl"), "");
  other.out = file("b");
  expect_error([&] { sweep(other); }, "do not belong to a sweep");
}

TEST_F(StaleCasesTest, AnUnfinishedSweepRunsOnlyItsStaleCasesAgain) {
  const std::string estimator = config(good);
  const auto with_second = [&](const std::string& command) {
    write_file(file("second/second.json"), Json{{"command", command}}.dump());
    SweepConfig c = config_of("a", estimator);
    const Json plan = {
        {"sources", {fixture_.source()}},
        {"estimators", {estimator, "motion_only", "external:" + file("second/second.json").string()}},
        {"seeds", 2}};
    c.plan = parse_plan(plan.dump(), file("plan.json").string(), "");
    return c;
  };
  fs::create_directories(file("second"));
  expect_error([&] { sweep(with_second("no_such_program_here")); }, "no_such_program_here");
  config(worse);
  const SweepOutcome outcome = sweep(with_second("true"));
  EXPECT_EQ(outcome.n_before, 2U);  // motion_only
  EXPECT_EQ(outcome.n_stale, 2U);
  EXPECT_THAT(messages_,
              ElementsAre(HasSubstr(
                  "'program': another version of it made 2 finished cases (program.sh changed, second/")));
  SweepConfig fresh = with_second("true");
  fresh.out = file("b");
  sweep(fresh);
  EXPECT_EQ(untimed_bytes("a"), untimed_bytes("b"));
  EXPECT_EQ(of("a"), of("b"));
}

TEST_F(StaleCasesTest, FoldersWithoutVersionsAreRunAgain) {
  const std::string estimator = config(good);
  sweep_into("a", estimator);
  Json plan = read_json(file("a/plan.json"));
  plan.erase(fingerprints_key);
  write_file(file("a/plan.json"), json_text(plan));
  EXPECT_EQ(sweep_into("a", estimator).n_before, 6U);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("it is not known which version of it made 6 finished cases")));
}

TEST_F(StaleCasesTest, AProgramThatChangesWhileItRunsIsStaleAfterwards) {
  const std::string estimator = config(std::string(good) + "; echo $seed >> $(dirname $0)/state.txt");
  write_file(file("state.txt"), "");
  sweep_into("a", estimator);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("'program' changed while it ran (state.txt changed)")));
  EXPECT_EQ(of("a").at("program").size(), 2U);
  EXPECT_EQ(sweep_into("a", estimator).n_stale, 6U);
}

TEST_F(StaleCasesTest, SummariesAreRunAgainAsAWhole) {
  const auto keeping_summaries = [&](const std::string& out, const std::string& estimator) {
    SweepConfig c = config_of(out, estimator);
    c.plan.keep = KeepOfCases::summary;
    return c;
  };
  sweep(keeping_summaries("a", config(good)));
  const std::string estimator = config(worse);
  EXPECT_EQ(sweep(keeping_summaries("a", estimator)).n_before, 0U);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("all cases are run again")));
  sweep(keeping_summaries("b", estimator));
  EXPECT_EQ(read_file(file("a/summary.bin")), read_file(file("b/summary.bin")));
  EXPECT_EQ(sweep(keeping_summaries("a", estimator)).n_before, 12U);
}

TEST_F(StaleCasesTest, ShardsOfDifferentVersionsAreNotMerged) {
  const auto shard = [&](uint64_t number, const std::string& estimator) {
    SweepConfig c = config_of("part" + std::to_string(number), estimator);
    c.shard = number;
    c.n_shards = 2;
    sweep(c);
  };
  shard(1, config(good));
  shard(2, config(worse));
  const std::vector<fs::path> parts = {file("part1"), file("part2")};
  expect_error([&] { merge_sweeps(parts, file("all")); },
               "part2: another version of 'program' ran there than in " + file("part1").string() +
                   " (program.sh changed)");
  merge_sweeps(parts, file("mixed"), /*allow_mixed=*/true);
  EXPECT_EQ(of("mixed").at("program").size(), 2U);
  EXPECT_EQ(of("mixed", "plan.json"), of("mixed"));
  shard(2, config(good));
  merge_sweeps(parts, file("all"));
  EXPECT_EQ(of("all").at("program").size(), 1U);
  sweep_into("whole", config(good));
  EXPECT_EQ(untimed_bytes("all"), untimed_bytes("whole"));
  EXPECT_EQ(sweep_into("all", config(good)).n_before, 12U);
}

}  // namespace
}  // namespace sextant
