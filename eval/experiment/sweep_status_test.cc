// The status of a sweep in shards, from files of real shards.

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/records/journal.h"

namespace sextant {
namespace {
using State = ShardStatus::State;

constexpr const char* plan_text =
    R"({"name": "status", "sources": ["synthetic:s18@0-2"], "estimators": ["motion_only"], "seeds": 10})";

class StatusOfSweep : public ::testing::Test {
 protected:
  void run_shard(uint64_t number, uint64_t n, const std::string& folder,
                 const std::string& plan = plan_text) {
    SweepConfig config;
    config.plan = parse_plan(plan, "plan.json", "");
    config.cache = PackCache(folder_.path() / "cache");
    config.out = sweep_ / folder;
    config.shard = number;
    config.n_shards = n;
    config.quiet = true;
    sweep(config);
  }

  TempFolder folder_;
  std::filesystem::path sweep_ = folder_.path() / "sweep";
};

TEST_F(StatusOfSweep, DistinguishesDoneRunningStoppedAndMissing) {
  for (const uint64_t number : {1, 2, 4}) run_shard(number, 6, "shards/" + std::to_string(number));
  // Shards 2 and 4 in the middle of their work: a journal, which a process is writing in one of them.
  for (const char* shard : {"2", "4"}) {
    std::filesystem::remove(sweep_ / "shards" / shard / "records.jsonl");
    write_file(sweep_ / "shards" / shard / "journal.jsonl", "");
  }
  const Journal writer(sweep_ / "shards/4/journal.jsonl", "test",
                       [](uint64_t, std::string_view) { return true; });
  const SweepStatus status = sweep_status(sweep_, 0);
  ASSERT_EQ(status.shards.size(), 6U);
  EXPECT_EQ(status.shards[0].state, State::done);
  EXPECT_EQ(status.shards[1].state, State::stopped);
  EXPECT_EQ(status.shards[2].state, State::missing);
  EXPECT_EQ(status.shards[3].state, State::running);
  EXPECT_EQ(status.n_cases, 10U);
  EXPECT_EQ(status.cases_done(), status.shards[0].cases_done);
  EXPECT_GT(status.cases_done(), 0U);
  EXPECT_EQ(status.to_submit(), "2-3,5-6");
  EXPECT_EQ(status.to_submit({3, 6}), "2,5");
  EXPECT_THAT(to_text(status), HasSubstr("1 of 6 done, 1 running, 1 stopped, 3 missing"));
  EXPECT_EQ(to_json(status)["to_submit"], "2-3,5-6");
}

TEST_F(StatusOfSweep, OfASweepThatHasNotBegun) {
  std::filesystem::create_directories(sweep_);
  EXPECT_EQ(sweep_status(sweep_, 12).to_submit(), "1-12");
  expect_error([&] { sweep_status(sweep_, 0); }, "no shard has begun here; give --shards N");
  expect_error([&] { sweep_status(sweep_ / "no", 3); }, "expected the folder of a sweep");
}

TEST_F(StatusOfSweep, TakesFoldersOfAnyName) {
  run_shard(2, 3, "part2");
  EXPECT_EQ(sweep_status(sweep_, 0).to_submit(), "1,3");
}

TEST_F(StatusOfSweep, RefusesShardsOfOtherSweeps) {
  run_shard(1, 3, "shards/1");
  expect_error([&] { sweep_status(sweep_, 4); },
               "shards/1: belongs to a sweep in 3 shards, expected one in 4");
  run_shard(1, 3, "shards/copy");
  expect_error([&] { sweep_status(sweep_, 0); }, "shard 1 is also in");
  std::filesystem::remove_all(sweep_ / "shards/copy");
  run_shard(
      2, 3, "shards/2",
      R"({"name": "other", "sources": ["synthetic:s18@0-2"], "estimators": ["joint_flow"], "seeds": 10})");
  expect_error([&] { sweep_status(sweep_, 0); }, "holds a shard of another plan than");
}

TEST(Durations, AreShort) {
  EXPECT_EQ(duration_text(90), "90 s");
  EXPECT_EQ(duration_text(720), "12 min");
  EXPECT_EQ(duration_text(12240), "3.4 h");
}

}  // namespace
}  // namespace sextant
