#include "sextant/eval/benchmark/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/eval/benchmark/card_document.h"
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
  EXPECT_THAT(message_of(R"({"name": "a", "title": "t", "metric": "Et"})"),
              HasSubstr("mine.json: key 'metric': unknown error 'Et': did you mean 'Et_m'"));
  EXPECT_THAT(message_of(R"({"name": "a", "title": "t", "metric": "Et_m",
    "breakdown": {"error_ratio": 2, "min_coverage": 2}})"),
              HasSubstr("mine.json: breakdown: key 'min_coverage': expected 0 to 1, got 2"));
}

/// A suite with one track, which has the levels 0.1 and 0.2 of two kinds of noise.
std::string suite_with(const std::string& metric, const std::string& nominal, const std::string& quick) {
  return fmt::format(R"({{"name": "a", "title": "t", "metric": "{}",
    "breakdown": {{"error_ratio": 3, "min_coverage": 0.8}},
    "tracks": [{{"name": "mixed", "title": "t", "level": "l", "nominal": {}, "quick": {},
      "plans": {{"mixed": {{"sources": ["synthetic:s18@0-1"], "noise": [
        {{"parameter": "depth.delta_d_px", "levels": [0.1]}},
        {{"level": 0.2, "noise": {{"flow": {{"epe_px": 0.2}}}}}}]}}}}}}]}})",
                     metric, nominal, quick);
}

TEST(Suite, NominalAndQuickLevelsMustBeLevelsOfTheTrack) {
  EXPECT_EQ(message_of(suite_with("Et_m", "0.1", "[0.2]")), "");
  EXPECT_THAT(
      message_of(suite_with("Et_m", "0.3", "[0.2]")),
      HasSubstr("mine.json: track 1: key 'nominal': no plan of the track has level 0.3: expected one of "
                "0.1, 0.2"));
  EXPECT_THAT(message_of(suite_with("Et_m", "0.1", "[0.1, 0.7]")),
              HasSubstr("mine.json: track 1: key 'quick': no plan of the track has level 0.7"));
}

TEST(Suite, AQuickRunReducesAListOfGrids) {
  const Suite suite = parse_suite(suite_with("Et_m", "0.2", "[0.2]"), "mine.json");
  const SuiteTrack& track = suite.tracks.front();
  const Plan plan =
      parse_plan(plan_text(suite, track, track.sweeps.front(), "joint_flow", /*quick=*/true), "mine", "");
  ASSERT_EQ(plan.levels.size(), 1U);
  EXPECT_EQ(plan.levels.front().level, 0.2);
}

TEST(Suite, TextsOfACardNameItsMetricAndLimits) {
  const Suite suite = parse_suite(suite_with("ER_deg", "0.1", "[]"), "mine.json");
  const std::string card = to_markdown(card_document(Card{.suite = "a"}, suite, {}));
  EXPECT_THAT(
      card, HasSubstr("the mean of E_R is 3 times that of the nominal level, or coverage falls below 80 %"));
  EXPECT_THAT(comparison_table({}, suite).caption, HasSubstr("Change of the mean E_R"));
}

}  // namespace
}  // namespace sextant
