// False-alarm rate and power of `sextant compare`, from recorded runs: the table in docs/ci.md.
// bench/gate_power makes the runs and calls this program.
//
// usage: gate_simulation BASE REORDERED MORE_POINTS [TRIALS]
//   BASE          folder of a sweep with 40 seeds or more
//   REORDERED     the same sweep with another start of the refinement, as if its points had another order
//   MORE_POINTS   the same sweep with 10 % more points
//   TRIALS        number of simulated comparisons per row (500)

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/eval/gate/side.h"
#include "simulated_gate.h"

namespace sextant {
namespace {

struct Scenario {
  std::string change;
  int seeds = 10;
  const char* expected = "";
  const Subjects& fresh;
  bool other_seeds = false;
  double changed_share = 1;
  Plant on_base = {}, on_new = {};
};

Plant on_camera(double factor) {
  return [factor](const Subject& subject, Interned metric, double) {
    return subject.body == "ego" && metric == "Et_m" ? factor : 1.0;
  };
}

/// Returns the factor exp(1.2 normal) for errors of objects: one error in twenty is then 7 times the median
/// or more.
double heavy_tail(const Subject& subject, Interned, double normal) {
  return subject.body == "ego" ? 1.0 : std::exp(1.2 * normal);
}

void print_row(const Scenario& scenario, const Subjects& base, int trials) try {
  SimulationOptions options{.seeds = scenario.seeds, .trials = trials};
  options.other_seeds = scenario.other_seeds;
  options.changed_share = scenario.changed_share;
  options.on_base = scenario.on_base;
  options.on_new = scenario.on_new;
  const SimulationCounts n = simulate_gate(base, scenario.fresh, options, Policy{},
                                           static_cast<int>(std::thread::hardware_concurrency()));
  if (n.invalid > 0)
    fmt::print(stderr, "{}: {} trials gave the verdict invalid\n", scenario.change, n.invalid);
  const auto percent = [&](int count) { return 100.0 * count / n.trials; };
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {} |\n", scenario.change, scenario.seeds, percent(n.ok),
             percent(n.regressed), percent(n.inconclusive), scenario.expected);
  std::fflush(stdout);
} catch (const Error& error) {
  fmt::print(stderr, "{}, {} seeds: left out: {}\n", scenario.change, scenario.seeds, error.what());
}

void run(int argc, char** argv) {
  if (argc < 4) throw std::runtime_error("usage: gate_simulation BASE REORDERED MORE_POINTS [TRIALS]");
  const auto read = [](const char* folder) { return read_side(folder).runs.at(0).subjects; };
  const Subjects base = read(argv[1]), reordered = read(argv[2]), more = read(argv[3]);
  const int trials = argc > 4 ? std::atoi(argv[4]) : 500;
  const char *neutral = "0 in 99 %", *found = "1 in 90 %", *found_by_six = "1 in 80 %";
  std::vector<Scenario> scenarios;
  for (const int seeds : {10, 6}) {
    scenarios.push_back({"other seeds", seeds, neutral, base, true});
    scenarios.push_back({"reordered points", seeds, neutral, reordered});
    scenarios.push_back({"10 % more points", seeds, neutral, more});
    scenarios.push_back({"reordered points, other seeds", seeds, neutral, reordered, true});
    scenarios.push_back({"1 record of 20 drawn again", seeds, neutral, base, true, 0.05});
    scenarios.push_back(
        {"other seeds, objects with heavy tails", seeds, neutral, base, true, 1, heavy_tail, heavy_tail});
    scenarios.push_back(
        {"camera's E_t +10 %", seeds, seeds == 10 ? found : "", base, false, 1, {}, on_camera(1.1)});
    scenarios.push_back(
        {"camera's E_t +10 %, reordered points", seeds, "", reordered, false, 1, {}, on_camera(1.1)});
    scenarios.push_back({"camera's E_t +10 %, other seeds", seeds, "", base, true, 1, {}, on_camera(1.1)});
    scenarios.push_back(
        {"camera's E_t +15 %", seeds, seeds == 6 ? found_by_six : "", base, false, 1, {}, on_camera(1.15)});
    scenarios.push_back(
        {"camera's E_t +15 %, reordered points", seeds, "", reordered, false, 1, {}, on_camera(1.15)});
    scenarios.push_back({"camera's E_t +15 %, other seeds", seeds, "", base, true, 1, {}, on_camera(1.15)});
    scenarios.push_back({"camera's E_t +30 %, other seeds", seeds, "", base, true, 1, {}, on_camera(1.3)});
    scenarios.push_back({"camera's E_t -10 %", seeds, neutral, base, false, 1, {}, on_camera(0.9)});
    scenarios.push_back(
        {"camera's E_t -10 %, other seeds", seeds, neutral, base, true, 1, {}, on_camera(0.9)});
  }
  fmt::print("| change | seeds | exit code 0 [%] | 1 [%] | 3 [%] | wanted |\n|---|---|---|---|---|---|\n");
  for (const Scenario& scenario : scenarios) print_row(scenario, base, trials);
}

}  // namespace
}  // namespace sextant

int main(int argc, char** argv) try {
  sextant::run(argc, argv);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "error: {}\n", error.what());
  return 2;
}
