#include "simulated_gate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/machine.h"
#include "sextant/base/philox.h"

namespace sextant {
namespace {

using Seeds = std::vector<uint64_t>;

Seeds seeds_of(const Subjects& subjects) {
  std::set<uint64_t> seeds;
  for (const auto& [subject, cases] : subjects) seeds.insert(cases.seeds.begin(), cases.seeds.end());
  return {seeds.begin(), seeds.end()};
}

void shuffle(PhiloxStream& random, Seeds& seeds) {
  for (size_t i = seeds.size(); i > 1; --i) std::swap(seeds[i - 1], seeds[random.below(i)]);
}

NumberColumns rows_of(const NumberColumns& columns, const std::vector<size_t>& rows) {
  NumberColumns out = columns;
  for (auto& [name, numbers] : out) reorder(rows, numbers);
  return out;
}

/// Copies the cases of the seeds `taken`, in this order, renumbered 0, 1, ...
Subjects resample(const Subjects& subjects, std::span<const uint64_t> taken) {
  Subjects out;
  for (const auto& [subject, cases] : subjects) {
    SubjectCases& chosen = out[subject];
    std::vector<size_t> rows;
    for (size_t label = 0; label < taken.size(); ++label) {
      const auto [first, last] = std::equal_range(cases.seeds.begin(), cases.seeds.end(), taken[label]);
      for (auto seed = first; seed != last; ++seed) {
        rows.push_back(static_cast<size_t>(seed - cases.seeds.begin()));
        chosen.seeds.push_back(label);
      }
    }
    for (const size_t row : rows) {
      chosen.frames.push_back(cases.frames[row]);
      chosen.lines.push_back(cases.lines[row]);
      chosen.statuses.push_back(cases.statuses[row]);
      chosen.gates.push_back(cases.gates[row]);
      chosen.have_truth.push_back(cases.have_truth[row]);
    }
    chosen.errors = rows_of(cases.errors, rows);
    chosen.truth = rows_of(cases.truth, rows);
    chosen.values = rows_of(cases.values, rows);
  }
  return out;
}

/// Replaces the status, errors and decisions of all but a share of NEW's cases by BASE's.
void keep_unchanged(const Subjects& base, double changed_share, PhiloxStream& random, Subjects& fresh) {
  for (const auto& [subject, pair] : by_key(base, fresh)) {
    if (!pair.base || !pair.fresh) continue;
    SubjectCases& changed = fresh.at(subject);
    for (const auto& [b, f] : pair_rows(pair).both) {
      if (random.uniform() < changed_share) continue;
      changed.statuses[f] = pair.base->statuses[b];
      changed.gates[f] = pair.base->gates[b];
      for (const auto columns : {&SubjectCases::errors, &SubjectCases::values}) {
        for (auto& [name, numbers] : changed.*columns) {
          const std::vector<double>* before = find_in(pair.base->*columns, name);
          if (before != nullptr) numbers[f] = (*before)[b];
        }
      }
    }
  }
}

void apply(const Plant& plant, PhiloxStream& random, Subjects& subjects) {
  if (!plant) return;
  for (auto& [subject, cases] : subjects) {
    for (size_t row = 0; row < cases.size(); ++row) {
      const double normal =
          std::sqrt(-2 * std::log(random.uniform())) * std::cos(2 * std::numbers::pi * random.uniform());
      for (auto& [name, numbers] : cases.errors) numbers[row] *= plant(subject, name, normal);
    }
  }
}

GateVerdict run_trial(const Subjects& base, const Subjects& fresh, Seeds seeds, int trial,
                      const SimulationOptions& options, const Policy& policy) {
  PhiloxStream random(options.seed, static_cast<uint64_t>(trial));
  shuffle(random, seeds);
  const auto n = static_cast<size_t>(options.seeds);
  Subjects before = resample(base, std::span(seeds).first(n));
  Subjects after = resample(fresh, std::span(seeds).subspan(options.other_seeds ? n : 0, n));
  if (options.changed_share < 1) keep_unchanged(before, options.changed_share, random, after);
  apply(options.on_base, random, before);
  apply(options.on_new, random, after);
  AccuracyComparison comparison;
  compare_accuracy(before, after, policy, 1, comparison);
  return comparison.worst_verdict();
}

}  // namespace

SimulationCounts simulate_gate(const Subjects& base, const Subjects& fresh, const SimulationOptions& options,
                               const Policy& policy, int jobs) {
  const Seeds seeds = seeds_of(base);
  const size_t needed = static_cast<size_t>(options.seeds) * (options.other_seeds ? 2 : 1);
  if (seeds.size() < needed)
    fail("simulation of the gate: {} seeds: expected {} or more", seeds.size(), needed);
  if (seeds != seeds_of(fresh)) fail("simulation of the gate: both runs must have the same seeds");
  std::vector<GateVerdict> verdicts(static_cast<size_t>(options.trials));
  parallel_for(options.trials, jobs, [&](int trial) {
    verdicts[static_cast<size_t>(trial)] = run_trial(base, fresh, seeds, trial, options, policy);
  });
  const auto count = [&](GateVerdict verdict) {
    return static_cast<int>(std::ranges::count(verdicts, verdict));
  };
  return {.trials = options.trials,
          .ok = count(GateVerdict::ok) + count(GateVerdict::improved),
          .regressed = count(GateVerdict::regressed),
          .inconclusive = count(GateVerdict::inconclusive),
          .invalid = count(GateVerdict::invalid)};
}

}  // namespace sextant
