#include "sextant/eval/benchmark/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/eval/experiment/plan.h"

namespace sextant {
namespace {

using ::testing::HasSubstr;

TEST(Suite, IsFrozen) {
  // Another hash means another benchmark: write a new suite, sextant-2, and leave this one as it is.
  EXPECT_EQ(find_suite("sextant-1").sha256,
            "25ffb58272be2fd238f315ed3908a0c89ab060ee43a2987b2aab1c769203ff76");
}

TEST(Suite, ExpandsIntoPlansThatSweepTakes) {
  const Suite suite = find_suite("sextant-1");
  for (const SuiteTrack& track : suite.tracks) {
    if (track.needs_data) continue;
    for (const SuiteSweep& sweep : track.sweeps) {
      SCOPED_TRACE(sweep.name);
      const Plan plan = parse_plan(plan_text(suite, track, sweep, "joint_flow", false), sweep.name, "");
      EXPECT_GE(plan.seeds.size(), track.name == "exact" ? 1U : 3U);
      const std::string quick = plan_text(suite, track, sweep, "joint_flow", true);
      if (quick.empty()) continue;
      const Plan quick_plan = parse_plan(quick, sweep.name, "");
      EXPECT_EQ(quick_plan.seeds.size(), 1U);
      EXPECT_LE(quick_plan.levels.size(), plan.levels.size());
    }
  }
}

TEST(Suite, NominalLevelsAreLevelsOfTheirTracks) {
  const Suite suite = find_suite("sextant-1");
  for (const SuiteTrack& track : suite.tracks) {
    if (track.needs_data) continue;
    bool found = false;
    for (const SuiteSweep& sweep : track.sweeps) {
      const Plan plan = parse_plan(plan_text(suite, track, sweep, "joint_flow", true), sweep.name, "");
      for (const PlanLevel& level : plan.levels) found |= level.level == track.nominal;
      if (found) break;
    }
    EXPECT_TRUE(found) << track.name << ": a quick run has the nominal level too";
  }
}

std::string message_of(const std::string& text) {
  try {
    parse_suite(text, "mine.json");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Suite, NamesWhatIsWrong) {
  EXPECT_THAT(message_of(R"({"name": "a", "titel": "b"})"),
              HasSubstr("unknown key 'titel': did you mean 'title'"));
  EXPECT_THAT(message_of(R"({"name": "a/b"})"), HasSubstr("name 'a/b'"));
  EXPECT_THAT(message_of(R"({"name": "a", "title": "t", "metric": "Et_m",
    "breakdown": {"error_ratio": 1, "min_coverage": 0.9}})"),
              HasSubstr("error_ratio"));
  EXPECT_THAT(message_of(R"({"name": "a", "title": "t", "metric": "Et_m",
    "breakdown": {"error_ratio": 2, "min_coverage": 0.9}, "tracks": []})"),
              HasSubstr("tracks"));
}

}  // namespace
}  // namespace sextant
