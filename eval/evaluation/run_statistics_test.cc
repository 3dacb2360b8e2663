#include "sextant/eval/evaluation/run_statistics.h"

#include <cmath>
#include <random>

#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/ego_drive_testing.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/ego_report.h"

namespace sextant {
namespace {

TEST(RunStatistics, PoolsErrorsAndComparesSystems) {
  std::vector<EgoResult> runs;
  for (int i = 0; i < 10; ++i) {
    PoseSeries estimate = drive(300, 10);
    const double amplitude = (i < 5 ? 0.1 : 0.2) * (1 + 0.1 * (i % 5));
    for (size_t k = 0; k < estimate.size(); ++k)
      estimate.positions_m[k][0] += amplitude * (1.5 + std::sin(37.0 * static_cast<double>(k)));
    runs.push_back(evaluate(drive(300, 10), estimate));
    runs.back().system = i < 5 ? "good" : "bad";
  }
  const std::vector<SystemSummary> systems = summarize_systems(run_errors(runs));
  ASSERT_EQ(systems.size(), 2);
  double sse = 0;
  for (int i = 0; i < 5; ++i) sse += runs[static_cast<size_t>(i)].statistics.sse;
  EXPECT_NEAR(systems[0].pooled.rmse, std::sqrt(sse / 1500), 1e-12);
  EXPECT_EQ(systems[0].n_errors, 1500);
  ASSERT_TRUE(systems[0].rmse_interval);
  EXPECT_LT(systems[0].rmse_interval->low, systems[0].pooled.rmse);
  EXPECT_GT(systems[0].rmse_interval->high, systems[0].pooled.rmse);

  const std::vector<SystemComparison> comparisons = compare_systems(run_errors(runs), IndependentUnit::runs);
  ASSERT_EQ(comparisons.size(), 1);
  EXPECT_NEAR(*comparisons[0].difference, -0.18, 0.002);  // 0.12 * 1.5 - 0.24 * 1.5
  EXPECT_DOUBLE_EQ(comparisons[0].p_corrected.value(), smallest_p_of_runs(5, 5))
      << "every good run is better";
  EXPECT_LT(compare_systems(run_errors(runs), IndependentUnit::blocks)[0].p_corrected.value(), 0.001);
  EXPECT_FALSE(summarize_systems(run_errors({runs.begin(), runs.begin() + 4}))[0].rmse_interval)
      << "four runs are too few to estimate their spread";

  const EgoReference reference = reference_of(drive(300, 10));
  EXPECT_DOUBLE_EQ(ego_json(runs, reference, {})["comparisons"][0]["p"].get<double>(), 2. / 252);
  EXPECT_THAT(to_text(ego_comparison_table(runs, {})), HasSubstr("that 5 and 5 runs can give is 0.0079"));
  runs[3] = runs[0];
  runs[3].system = "same";
  runs.resize(4);
  const Json comparison = ego_json(runs, reference, {})["comparisons"];
  ASSERT_EQ(comparison.size(), 1);
  EXPECT_FALSE(comparison[0].contains("p")) << "3 runs and 1 run";
  EXPECT_EQ(comparison[0]["why_no_p"],
            "errors along one path depend on each other: give several runs of each system");
  EXPECT_THAT(to_text(ego_comparison_table(runs, {})), HasSubstr("No p of good and same: errors along one"));
  EgoOptions relative;
  relative.rpe_lengths = {PairSelection{}};
  EXPECT_TRUE(ego_json(runs, reference, relative)["comparisons"][0].contains("p"));
}

/// Share of 200 comparisons of systems that err alike in which p is below 5 %. `run_of(random, system)` makes
/// one run.
template <typename RunOf>
double share_of_false_alarms(int n_runs, IndependentUnit unit, RunOf run_of) {
  constexpr int n_trials = 200;
  int n_significant = 0;
  for (int trial = 0; trial < n_trials; ++trial) {
    std::mt19937_64 random(static_cast<uint64_t>(trial));
    std::vector<RunErrors> runs;
    for (const char* system : {"a", "b"}) {
      for (int i = 0; i < n_runs; ++i) runs.push_back(run_of(random, system));
    }
    n_significant += compare_systems(runs, unit).at(0).p.value() < 0.05;
  }
  return static_cast<double>(n_significant) / n_trials;
}

TEST(RunStatistics, RandomWalksOfTheSameLawAreRarelyCalledDifferent) {
  const auto walk = [](std::mt19937_64& random, const char* system) {
    std::normal_distribution<double> step(0, 0.1);
    RunErrors run{system, "", {}, {}, 0};
    double offset = 0;
    for (int row = 0; row < 200; ++row) {
      offset += step(random);
      run.errors.push_back(std::abs(offset));
      run.steps.emplace_back(0, row);
    }
    return run;
  };
  EXPECT_LT(share_of_false_alarms(6, IndependentUnit::runs, walk), 0.08);
  EXPECT_GT(share_of_false_alarms(6, IndependentUnit::blocks, walk), 0.3)
      << "blocks of one path are not independent";
}

TEST(RunStatistics, ObjectsSeenByOneCameraAreNotIndependent) {
  const auto seen_together = [](std::mt19937_64& random, const char* system) {
    std::normal_distribution<double> normal(0, 1);
    RunErrors run{system, "", {}, {}, 0};
    for (int frame = 0; frame < 60; ++frame) {
      const double of_camera = normal(random);
      for (int object = 1; object <= 10; ++object) {
        run.errors.push_back(5 + of_camera + normal(random));
        run.steps.emplace_back(object, frame);
      }
    }
    return run;
  };
  EXPECT_LT(share_of_false_alarms(1, IndependentUnit::blocks, seen_together), 0.08);
}

TEST(RunStatistics, PairsThatOverlapAreNotIndependent) {
  constexpr size_t span = 20;
  const auto all_pairs = [](size_t n_overlapping) {
    return [n_overlapping](std::mt19937_64& random, const char* system) {
      std::normal_distribution<double> step(0, 0.1);
      RunErrors run{system, "", {}, {}, n_overlapping};
      std::vector<double> drift = {0};
      for (int row = 0; row < 600; ++row) {
        drift.push_back(drift.back() + step(random));
        if (drift.size() <= span) continue;
        run.errors.push_back(std::abs(drift.back() - drift[drift.size() - 1 - span]));
        run.steps.emplace_back(0, row);
      }
      return run;
    };
  };
  EXPECT_LT(share_of_false_alarms(1, IndependentUnit::blocks, all_pairs(span - 1)), 0.09);
  std::mt19937_64 random(1);
  const std::vector<RunErrors> runs = {all_pairs(100)(random, "a"), all_pairs(100)(random, "b")};
  const SystemComparison of_long_pairs = compare_systems(runs, IndependentUnit::blocks).at(0);
  EXPECT_FALSE(of_long_pairs.p);
  EXPECT_THAT(of_long_pairs.why_no_p, HasSubstr("each error overlaps with 100 later ones"));
}

TEST(RunStatistics, PIsThatOfTheDifference) {
  // a is better in all frames but one, in which many objects outweigh the others in the mean of the steps.
  RunErrors a{"a", "", {}, {}, 0}, b{"b", "", {}, {}, 0};
  const auto add = [&](int object, int frame, double difference) {
    for (RunErrors* run : {&a, &b}) {
      run->errors.push_back(1 + (run == &a ? difference : 0) + 0.001 * frame);
      run->steps.emplace_back(object, frame);
    }
  };
  for (int frame = 0; frame < 39; ++frame) add(1, frame, -0.01);
  for (int object = 1; object <= 60; ++object) add(object, 39, 0.02);
  const SystemComparison c = compare_systems({a, b}, IndependentUnit::blocks).at(0);
  EXPECT_GT(c.difference, 0);
  EXPECT_EQ(c.p, 1);
}

TEST(RunStatistics, NoPWhereNoOutcomeCouldBeSignificant) {
  std::vector<RunErrors> runs;
  for (int i = 0; i < 6; ++i) {
    RunErrors run{i < 3 ? "a" : "b", "", {}, {}, 0};
    for (int row = 0; row < 6; ++row) {
      run.errors.push_back(i + 0.1 * row);
      run.steps.emplace_back(row % 2, row / 2);
    }
    runs.push_back(std::move(run));
  }
  const SystemComparison of_runs = compare_systems(runs, IndependentUnit::runs).at(0);
  EXPECT_FALSE(of_runs.p);
  EXPECT_THAT(of_runs.why_no_p, HasSubstr("smallest p that 3 and 3 runs can give is 0.10"));
  const SystemComparison of_blocks = compare_systems(runs, IndependentUnit::blocks).at(0);
  EXPECT_FALSE(of_blocks.p) << "six steps, but of three frames";
  EXPECT_THAT(of_blocks.why_no_p, HasSubstr("6 frames"));
}

}  // namespace
}  // namespace sextant
