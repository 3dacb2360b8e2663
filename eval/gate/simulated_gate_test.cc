// The simulation of bench/gate_power, shortened to seconds, with generated records instead of recorded ones.

#include "simulated_gate.h"

#include "sextant/base/testing.h"
#include "sextant/eval/gate/testing.h"

namespace sextant {
namespace {

constexpr int trials = 200;

Subjects subjects_of(const std::vector<Record>& records) {
  SubjectCollector collector;
  for (const Record& record : records) collector.add(record);
  return collector.take();
}

const Subjects& recorded() {
  static const Subjects subjects = subjects_of(sweep_records(24));
  return subjects;
}

Plant camera_times(double factor) {
  return [factor](const Subject& subject, Interned metric, double) {
    return subject.body == "ego" && metric == "Et_m" ? factor : 1.0;
  };
}

SimulationCounts simulate(const SimulationOptions& options) {
  return simulate_gate(recorded(), recorded(), options, Policy{}, 2);
}

TEST(GateSimulation, ChangesThatAreNeutralExitWithZero) {
  for (const int seeds : {6, 10}) {
    for (const double changed_share : {1.0, 0.05}) {
      const SimulationCounts n =
          simulate({.seeds = seeds, .trials = trials, .other_seeds = true, .changed_share = changed_share});
      EXPECT_EQ(n.trials, trials);
      EXPECT_GE(n.ok, trials - 4) << seeds << " seeds, changed " << changed_share;
    }
  }
}

TEST(GateSimulation, HeavyTailsOfObjectsAreNoFalseAlarm) {
  const Plant tail = [](const Subject& subject, Interned, double normal) {
    return subject.body == "ego" ? 1.0 : std::exp(1.2 * normal);
  };
  SimulationOptions options{.seeds = 10, .trials = trials, .other_seeds = true};
  options.on_base = options.on_new = tail;
  EXPECT_LE(simulate(options).regressed, 4);
}

TEST(GateSimulation, PlantedChangesOfTheCameraAreFound) {
  const auto planted = [](int seeds, double factor) {
    SimulationOptions options{.seeds = seeds, .trials = trials};
    options.on_new = camera_times(factor);
    return simulate(options);
  };
  EXPECT_GE(planted(10, 1.1).regressed, trials * 9 / 10);
  EXPECT_GE(planted(6, 1.15).regressed, trials * 8 / 10);
  EXPECT_GE(planted(10, 0.9).ok, trials * 99 / 100);
  EXPECT_GE(planted(6, 0.9).ok, trials * 99 / 100);
}

TEST(GateSimulation, IsAPureFunctionOfItsSeed) {
  const auto run = [](int jobs) {
    SimulationOptions options{.seeds = 6, .trials = 20, .seed = 3, .other_seeds = true};
    options.on_new = camera_times(1.2);
    return simulate_gate(recorded(), recorded(), options, Policy{}, jobs).regressed;
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(GateSimulation, TooFewSeedsAreRefused) {
  EXPECT_THAT(error_of([] { simulate({.seeds = 13, .trials = 1, .other_seeds = true}); }),
              HasSubstr("expected 26"));
}

}  // namespace
}  // namespace sextant
