
// Outputs of external programs that are read again, without running the programs.

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/external/external_estimator.h"
#include "sextant/eval/external/external_testing.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

TEST(Rescore, NumbersOfARunAreKeptOrRefused) {
  const TempFolder folder;
  const auto error = [&](const char* level, const char* seeds) {
    folder.write(
        "run.json",
        fmt::format(R"({{"configuration":{{"sources":["synthetic:s18"],"estimator":"external:x.json",)"
                    R"("options":{{}},"noise":{{}},"level":{},"seeds":{}}}}})",
                    level, seeds));
    return error_of([&] { rescored_run({.folder = folder.path()}); });
  };
  EXPECT_EQ(error("0.5", "2"), "no error");
  for (const char* seeds : {"4294967298", "2.5", "true"})
    EXPECT_THAT(error("0.5", seeds), HasSubstr("run.json: key 'seeds': expected")) << seeds;
  EXPECT_THAT(error("true", "2"), HasSubstr("run.json: key 'level': expected"));
}

TEST(Rescore, ASweepWithoutItsPlanIsNoRun) {
  const TempFolder folder;
  folder.write("run.json",
               R"({"configuration": {"sources": [{"source": "synthetic:s18"}], "estimators": []}})");
  EXPECT_FALSE(is_sweep(folder.path()));
  EXPECT_THAT(error_of([&] { rescored_run({.folder = folder.path()}); }),
              HasSubstr("run.json: belongs to a sweep, but this folder has no plan.json"));
}

TEST(Rescore, ShardOfASweepIsOneOfThem) {
  add_external_estimators();
  const TempFolder folder;
  const auto error = [&](const char* shard) {
    folder.write(
        "plan.json",
        fmt::format(R"({{"plan":{{"name":"t","sources":["synthetic:s18"],"estimators":[)"
                    R"({{"name":"external:x.json","options":{{"command":"p {{output}}"}}}}],"seeds":1}},)"
                    R"("shard":{}}})",
                    shard));
    return error_of([&] { rescored_sweep({.folder = folder.path()}); });
  };
  EXPECT_EQ(error("[1, 2]"), "no error");
  for (const char* shard : {"[0, 0]", "[-1, 2]", "[0.5, 2]", "[2, 2]", "[0, 2, 3]", "[true, 2]"})
    EXPECT_THAT(error(shard), HasSubstr("plan.json: key 'shard': expected [I, N]")) << shard;
}

class RescoredResults : public ExternalEstimatorTest {};

TEST_F(RescoredResults, ARunIsScoredAgain) {
  write_vdo_results();
  const std::string estimator =
      config("cp $(dirname $0)/vdo/* $output/; echo ran >> $(dirname $0)/runs; echo no >&2; exit 3",
             vdo_set("initial"));
  RunConfig c = run_config(estimator, 2);
  c.folder = file("out") / "external";
  const RunResult first = run(c);
  write_output_folder(file("out"), run_files(first));
  const auto before = files_below(file("out"));
  const auto rescore = [&](const RescoreRequest& request) {
    RunConfig again = rescored_run(request);
    again.quiet = true;
    return run(again);
  };
  const RunResult same = rescore({.folder = file("out")});
  EXPECT_EQ(same.configuration, first.configuration);
  ASSERT_EQ(same.records.size(), first.records.size());
  // Times and costs are those of the program's run; frames are decoded again.
  for (size_t i = 0; i < same.records.size(); ++i) {
    Record a = same.records[i], b = first.records[i];
    for (Record* r : {&a, &b}) {
      r->time_ms.erase("decode");
      r->time_ms.erase("extraction");
    }
    EXPECT_EQ(write_records({a}), write_records({b}));
  }
  EXPECT_EQ(same.sources.front().problems, first.sources.front().problems);
  last_ = rescore({.folder = file("out"), .options = {{"estimator", vdo_set("refined")}}});
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_LT(worst("object:1", "Et_body_m"), 1e-8);
  // The files of the first configuration may be gone.
  fs::remove(file("program.json"));
  const RunResult gone = rescore({.folder = file("out")});
  EXPECT_TRUE(std::ranges::equal(gone.records, same.records, {}, strip_times, strip_times));
  Json other = vdo_set("refined");
  other["command"] = "never";
  write_file(file("other.json"), other.dump());
  last_ = rescore({.folder = file("out"), .config = file("other.json").string()});
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_EQ(last_.records.front().estimator, "other");
  EXPECT_EQ(read_file(file("runs")), "ran\nran\n");
  EXPECT_EQ(files_below(file("out")), before);
  // Outputs that cannot be read again.
  fs::remove_all(file("out") / "external" / "vdo_data_3-7_seed1" / "output");
  expect_error([&] { rescore({.folder = file("out")}); }, "outputs are kept with \"keep\" output or all");
  fs::remove(file("out") / "external" / "vdo_data_3-7_seed0" / "case.json");
  expect_error([&] { rescore({.folder = file("out")}); }, "case.json: does not exist");
  expect_error([&] { is_sweep(file("data")); }, "holds neither run.json nor plan.json");
  c.estimator = "motion_only";
  write_output_folder(file("inside"), run_files(run(c)));
  expect_error([&] { rescored_run({.folder = file("inside")}); },
               "\"motion_only\" is not an external program");
}

TEST_F(RescoredResults, ASweepIsScoredAgain) {
  write_vdo_results();
  Json more = vdo_set("initial");
  more["settings"] = "my.yaml";
  write_file(file("my.yaml"), "fx: {fx}\n");
  config("cp $(dirname $0)/vdo/* $output/; echo ran >> $(dirname $0)/runs", more);
  const SweepConfig c = sweep_config("out", {{"name", "external:program.json"}, {"label", "mine"}}, 2);
  sweep(c);
  fs::remove(file("program.json"));
  fs::remove(file("my.yaml"));
  const std::string runs = read_file(file("runs"));
  EXPECT_EQ(runs.size(), 4 * std::string("ran\n").size());
  const auto before = files_below(file("out"));
  const auto rescore = [&](const char* out, const Json& options) {
    SweepConfig again = rescored_sweep({.folder = file("out"), .options = options});
    again.out = file(out);
    again.cache = c.cache;
    again.quiet = true;
    sweep(again);
    return untimed(read_records(file(out) / "records.jsonl"));
  };
  const std::vector<Record> first = untimed(read_records(file("out") / "records.jsonl"));
  EXPECT_EQ(rescore("same", Json::object()), first);
  const std::vector<Record> refined = rescore("refined", {{"estimator", vdo_set("refined")}});
  ASSERT_EQ(refined.size(), first.size());
  int changed = 0;
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(refined[i].estimator, first[i].estimator);
    changed += refined[i] != first[i];
    if (first[i].estimator != "mine") {
      EXPECT_EQ(refined[i], first[i]);
    } else if (first[i].is_ego()) {
      EXPECT_LT(refined[i].errors.at("Et_m"), 1e-9);
    }
  }
  EXPECT_GT(changed, 0);
  EXPECT_EQ(read_file(file("runs")), runs);
  EXPECT_EQ(files_below(file("out")), before);
}

TEST_F(RescoredResults, ChangedDataAreNotScoredAgain) {
  write_vdo_results();
  const std::string estimator = config("cp $(dirname $0)/vdo/* $output/", vdo_set("initial"));
  RunConfig c = run_config(estimator);
  c.folder = file("run") / "external";
  write_output_folder(file("run"), run_files(run(c)));
  const SweepConfig swept = sweep_config("sweep", {{"name", "external:program.json"}}, 1);
  sweep(swept);
  const fs::path truth = file("data") / "pose_gt.txt";
  const std::string before = read_file(truth);
  const auto rescore_run = [&] {
    RunConfig again = rescored_run({.folder = file("run")});
    again.quiet = true;
    run(again);
  };
  const auto rescore_sweep = [&] {
    SweepConfig again = rescored_sweep({.folder = file("sweep")});
    again.out = file("again");
    again.cache = swept.cache;
    again.quiet = true;
    sweep(again);
  };
  write_file(truth, before + "\n");
  for (const auto& [kind, message] :
       {std::pair("run", error_of(rescore_run)), std::pair("sweep", error_of(rescore_sweep))}) {
    EXPECT_THAT(message, HasSubstr(fmt::format("{}: holds a {} of data that have changed since (vdo:data "
                                               "data/pose_gt.txt); restore the data, or start the {} over",
                                               file(kind).string(), kind, kind)));
  }
  EXPECT_FALSE(fs::exists(file("again") / "records.jsonl"));
  write_file(truth, before);
  rescore_run();
  rescore_sweep();
}

}  // namespace
}  // namespace sextant
