
#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/external/external_estimator.h"

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

}  // namespace
}  // namespace sextant
