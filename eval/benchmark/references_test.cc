// The reference systems whose records and cards are stored in results/benchmark: they follow from this
// program, and their order.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

fs::path references() { return fs::path(SEXTANT_SOURCE) / "results" / "benchmark"; }

Card card_of(const std::string& name) {
  const fs::path file = references() / name / "card.json";
  return parse_card(read_file(file), file.string());
}

/// Mean E_t of the only result of a card, m.
double error_of(const Card& card, const std::string& track, const std::string& body, double level) {
  const auto point = std::ranges::find_if(card.curves, [&](const CurvePoint& p) {
    return p.estimator == card.results.front() && p.track == track && p.body == body && p.level == level;
  });
  return point == card.curves.end() || !point->Et_m ? std::nan("") : point->Et_m->value;
}

TEST(References, CardsAreWhatTheirRecordsGive) {
  const Suite suite = find_suite("sextant-1");
  int n = 0;
  for (const auto& entry : fs::directory_iterator(references())) {
    if (!fs::exists(entry.path() / "card.json")) continue;
    Json stored = to_json(card_of(entry.path().filename().string()));
    Json made = to_json(make_card(suite, entry.path()));
    for (const char* key : {"costs", "program"}) {
      stored.erase(key);
      made.erase(key);
    }
    EXPECT_EQ(stored, made) << entry.path();
    ++n;
  }
  EXPECT_GE(n, 9);
}

// The estimators must still give the stored numbers, because users compare their results with these. The
// tolerances allow for the rounding of other compilers.
TEST(References, OneCaseOfEachBuiltInEstimatorGivesTheStoredNumbersAgain) {
  const Suite suite = find_suite("sextant-1");
  const SuiteTrack& track = suite.track("far");
  const TempFolder folder;
  using Key = std::tuple<double, uint64_t, int, Interned>;
  for (const std::string name : {"joint_flow", "joint_flow_depth", "motion_only"}) {
    std::map<Key, Record> stored;
    for (const Record& record : read_records(references() / name / "far" / "records.jsonl")) {
      if (record.sequence == "s18") stored[{record.level, record.seed, record.frame, record.body}] = record;
    }
    SweepConfig config;
    config.plan =
        parse_plan(plan_text(suite, track, track.sweeps.front(), name, /*quick=*/false), "plan", "");
    std::erase_if(config.plan.sources,
                  [](const SourceSpec& source) { return !source.text.starts_with("synthetic:s18"); });
    config.plan.levels = {config.plan.levels.back()};
    config.plan.seeds = {0};
    config.out = folder.path() / name;
    config.cache = PackCache(folder.path() / "cache");
    config.quiet = true;
    sweep(config);
    int n = 0;
    for (const Record& record : read_records(config.out / "records.jsonl")) {
      if (!track.counts(record) || record.status != Status::ok) continue;
      const auto same = stored.find({record.level, record.seed, record.frame, record.body});
      ASSERT_NE(same, stored.end()) << name << ", frame " << record.frame << ", " << record.body;
      for (const auto& [error, value] : same->second.errors)
        EXPECT_NEAR(record.errors.at(error), value, 1e-4 * value + 1e-6)
            << name << ", frame " << record.frame << ", " << record.body << ", " << error;
      const auto nees = find_number(same->second.values, "nees");
      if (nees) {
        EXPECT_NEAR(record.values.at("nees"), *nees, 1e-3 * *nees) << name << ", frame " << record.frame;
      }
      ++n;
    }
    EXPECT_GE(n, 20) << name;
  }
}

TEST(References, InliersOfRansacAreWorseThanTheJointOptimisation) {
  const Card joint = card_of("joint_flow"), pnp = card_of("opencv_pnp");
  const double ratio = error_of(pnp, "depth", "camera", 0.2) / error_of(joint, "depth", "camera", 0.2);
  EXPECT_GT(ratio, 1.5);
  EXPECT_LT(ratio, 3);
  EXPECT_GT(error_of(pnp, "flow", "camera", 2) / error_of(joint, "flow", "camera", 2), 3);
}

TEST(References, DepthsOfBothFramesMakeEstimatesRobustAgainstDepthNoise) {
  const Card own = card_of("joint_flow_depth");
  for (const char* other : {"joint_flow", "motion_only", "opencv_pnp", "multimot_track", "vdo_slam_front"}) {
    // At four times the nominal noise of depth.
    EXPECT_LT(error_of(own, "depth", "object", 0.8), error_of(card_of(other), "depth", "object", 0.8))
        << other;
  }
  const auto level_of = [](const Card& card) {
    for (const Breakdown& row : card.breakdowns)
      if (row.track == "depth" && row.body == "object") return row.at;
    return BreakdownLevel();
  };
  const BreakdownLevel ours = level_of(own), joint = level_of(card_of("joint_flow"));
  const auto reached = [](const BreakdownLevel& at) {
    return at.cause == BreakdownCause::none ? std::numeric_limits<double>::infinity() : at.level;
  };
  EXPECT_GT(reached(ours), reached(joint));
}

}  // namespace
}  // namespace sextant
