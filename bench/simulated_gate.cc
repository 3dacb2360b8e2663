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

Seeds seeds_of(const std::vector<SubjectCases>& subjects) {
  std::set<uint64_t> seeds;
  for (const SubjectCases& cases : subjects) seeds.insert(cases.seeds.begin(), cases.seeds.end());
  return {seeds.begin(), seeds.end()};
}

void shuffle(PhiloxStream& random, Seeds& seeds) {
  for (size_t i = seeds.size(); i > 1; --i) std::swap(seeds[i - 1], seeds[random.below(i)]);
}

std::vector<NumberColumn> rows_of(const std::vector<NumberColumn>& columns, const std::vector<size_t>& rows) {
  std::vector<NumberColumn> out;
  for (const NumberColumn& column : columns) {
    out.push_back({column.name, {}});
    for (const size_t row : rows) out.back().numbers.push_back(column.numbers[row]);
  }
  return out;
}

/// Copies the cases of the seeds `taken`, in this order, renumbered 0, 1, ...
std::vector<SubjectCases> resample(const std::vector<SubjectCases>& subjects,
                                   std::span<const uint64_t> taken) {
  std::vector<SubjectCases> out;
  for (const SubjectCases& cases : subjects) {
    SubjectCases chosen(cases.subject);
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
    chosen.decisions = rows_of(cases.decisions, rows);
    out.push_back(std::move(chosen));
  }
  return out;
}

/// Replaces the status, errors and decisions of all but a share of NEW's cases by BASE's.
void keep_unchanged(const std::vector<SubjectCases>& base, double changed_share, PhiloxStream& random,
                    std::vector<SubjectCases>& fresh) {
  for (const SubjectPair& pair : pair_subjects(base, fresh)) {
    if (pair.base == nullptr || pair.fresh == nullptr) continue;
    auto& changed = fresh[static_cast<size_t>(pair.fresh - fresh.data())];
    for (const auto& [b, f] : pair_rows(pair).both) {
      if (random.uniform() < changed_share) continue;
      changed.statuses[f] = pair.base->statuses[b];
      changed.gates[f] = pair.base->gates[b];
      for (const auto columns : {&SubjectCases::errors, &SubjectCases::decisions}) {
        for (NumberColumn& column : changed.*columns) {
          const NumberColumn* before = find_column(pair.base->*columns, column.name);
          if (before != nullptr) column.numbers[f] = before->numbers[b];
        }
      }
    }
  }
}

void apply(const Plant& plant, PhiloxStream& random, std::vector<SubjectCases>& subjects) {
  if (!plant) return;
  for (SubjectCases& cases : subjects) {
    for (size_t row = 0; row < cases.size(); ++row) {
      const double normal =
          std::sqrt(-2 * std::log(random.uniform())) * std::cos(2 * std::numbers::pi * random.uniform());
      for (NumberColumn& column : cases.errors)
        column.numbers[row] *= plant(cases.subject, column.name, normal);
    }
  }
}

GateVerdict run_trial(const std::vector<SubjectCases>& base, const std::vector<SubjectCases>& fresh,
                      Seeds seeds, int trial, const SimulationOptions& options, const Policy& policy) {
  PhiloxStream random(options.seed, static_cast<uint64_t>(trial));
  shuffle(random, seeds);
  const auto n = static_cast<size_t>(options.seeds);
  std::vector<SubjectCases> before = resample(base, std::span(seeds).first(n));
  std::vector<SubjectCases> after = resample(fresh, std::span(seeds).subspan(options.other_seeds ? n : 0, n));
  if (options.changed_share < 1) keep_unchanged(before, options.changed_share, random, after);
  apply(options.on_base, random, before);
  apply(options.on_new, random, after);
  AccuracyComparison comparison;
  compare_accuracy(before, after, policy, 1, comparison);
  return comparison.worst_verdict();
}

}  // namespace

SimulationCounts simulate_gate(const std::vector<SubjectCases>& base, const std::vector<SubjectCases>& fresh,
                               const SimulationOptions& options, const Policy& policy, int jobs) {
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
