#pragma once

// False-alarm rate and power of the gate, by simulation: no theory covers bodies, frames and seeds of several sources
// together. A trial takes some seeds of a recorded run as BASE and makes NEW from a recorded run of the changed estimator,
// with a planted effect on top; compare_accuracy() judges it as it would two runs.

#include <functional>
#include <vector>

#include "sextant/eval/gate/accuracy.h"

namespace sextant {

/// Factor of one error of one case; `normal` is a standard normal number that all errors of the case share.
using Plant = std::function<double(const Subject& subject, Interned metric, double normal)>;

struct SimulationOptions {
  int seeds = 10;  ///< of every run
  int trials = 500;
  uint64_t seed = 1;          ///< of the simulation
  bool other_seeds = false;   ///< NEW takes seeds of its run that BASE does not have: all noise is drawn again
  double changed_share = 1;   ///< of NEW's cases that differ from BASE's, chosen at random
  Plant on_base, on_new;      ///< applied after that; empty: none
};

struct SimulationCounts {
  int trials = 0, ok = 0, regressed = 0, inconclusive = 0, invalid = 0;  ///< ok: also improved
};

/// `base` and `fresh` are runs with the same seeds, at least `seeds` of them, twice as many for other_seeds. Throws Error
/// where they have fewer.
SimulationCounts simulate_gate(const std::vector<SubjectCases>& base, const std::vector<SubjectCases>& fresh,
                               const SimulationOptions& options, const Policy& policy, int jobs);

}  // namespace sextant
