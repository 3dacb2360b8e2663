#pragma once

// False-alarm rate and power of the gate, by simulation, because no theory covers bodies, frames and seeds of
// several sources together. A trial takes some seeds of a recorded run as BASE, and makes NEW from a recorded
// run of the changed estimator with a planted effect. compare_accuracy() then judges them like two runs.

#include <functional>
#include <vector>

#include "sextant/eval/gate/accuracy.h"

namespace sextant {

/// Returns the factor by which one error of one case is multiplied; `normal` is a standard normal number that
/// all errors of the case share.
using Plant = std::function<double(const Subject& subject, Interned metric, double normal)>;

struct SimulationOptions {
  int seeds = 10;  ///< number of seeds in each simulated run
  int trials = 500;
  uint64_t seed = 1;         ///< seed of the simulation
  bool other_seeds = false;  ///< NEW takes seeds that BASE does not use, so that all noise differs
  double changed_share = 1;  ///< share of NEW's cases that differ from BASE's, chosen at random
  Plant on_base, on_new;     ///< factors applied at the end; empty: none
};

/// Number of trials by verdict.
struct SimulationCounts {
  int trials = 0, ok = 0, regressed = 0, inconclusive = 0, invalid = 0;  ///< `ok` includes improved
};

/// Simulates the gate. `base` and `fresh` are runs with the same seeds, at least options.seeds of them, or
/// twice as many for other_seeds. Throws Error if they have fewer seeds, or different ones.
SimulationCounts simulate_gate(const Subjects& base, const Subjects& fresh, const SimulationOptions& options,
                               const Policy& policy, int jobs);

}  // namespace sextant
