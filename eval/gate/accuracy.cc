#include "sextant/eval/gate/accuracy.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "sextant/base/parallel_for.h"

namespace sextant {
namespace {

std::string short_case(const SubjectCases& cases, size_t row) {
  return fmt::format("seed {} frame {}", cases.seeds[row], cases.frames[row]);
}

std::string full_case(const SubjectCases& cases, size_t row) {
  return fmt::format("{} {}", to_string(cases.subject), short_case(cases, row));
}

/// A subject that both sides have, and its cases that they share.
struct PairedCases {
  const SubjectCases& base;
  const SubjectCases& fresh;
  std::vector<RowPair> rows;
};

std::vector<PairedCases> pair_up(const std::vector<SubjectCases>& base,
                                 const std::vector<SubjectCases>& fresh, const SamenessPolicy& same,
                                 std::vector<Mismatch>& findings) {
  Tally missing("cases", same.cases), added("new_cases", same.new_cases);
  std::vector<PairedCases> shared;
  for (const SubjectPair& pair : pair_subjects(base, fresh)) {
    PairedRows rows = pair_rows(pair);
    for (const size_t row : rows.only_base) missing.add(full_case(*pair.base, row), "there", "missing");
    for (const size_t row : rows.only_fresh) added.add(full_case(*pair.fresh, row), "missing", "there");
    if (!rows.both.empty()) shared.push_back({*pair.base, *pair.fresh, std::move(rows.both)});
  }
  missing.move_to(findings);
  added.move_to(findings);
  return shared;
}

std::optional<double> number_at(const NumberColumn* column, size_t row) {
  return column == nullptr || !column->has(row) ? std::nullopt : std::optional(column->numbers[row]);
}

/// What the truth alone decides must not change.
void check_truth(const PairedCases& cases, Tally& truth) {
  constexpr double rounding = 1e-9;
  const std::vector<ColumnPair> columns = pair_columns(cases.base.truth, cases.fresh.truth);
  for (const auto& [b, f] : cases.rows) {
    for (const ColumnPair& column : columns) {
      const std::optional<double> before = number_at(column.base, b), after = number_at(column.fresh, f);
      const bool same =
          before.has_value() == after.has_value() &&
          (!before || std::abs(*before - *after) <= rounding * std::max(1.0, std::abs(*before)));
      if (same) continue;
      const auto said = [](const std::optional<double>& x) { return x ? fmt::format("{}", *x) : "missing"; };
      truth.add(fmt::format("{} {}", full_case(cases.base, b), column.name), said(before), said(after));
    }
  }
}

StatusRow compare_statuses(const PairedCases& cases, const AccuracyPolicy& policy) {
  const SubjectCases &base = cases.base, &fresh = cases.fresh;
  StatusRow row{.subject = base.subject, .n = static_cast<int>(cases.rows.size())};
  for (const auto& [b, f] : cases.rows) {
    const bool before = base.is_estimated(b), after = fresh.is_estimated(f);
    if (base.statuses[b] == fresh.statuses[f] && base.gates[b] == fresh.gates[f]) continue;
    if (before && after) continue;  // ok and no_truth: see check_truth()
    (before ? row.n_lost : after ? row.n_gained : row.n_other)++;
    if (row.example.empty() || (before && row.n_lost == 1)) {
      row.example = fmt::format("{}: {} -> {}", short_case(base, b), to_string(base.statuses[b]),
                                to_string(fresh.statuses[f]));
    }
  }
  if (row.n_lost > row.n_gained + policy.max_lost) row.verdict = GateVerdict::regressed;
  if (row.n_gained > row.n_lost) row.verdict = GateVerdict::improved;
  return row;
}

/// Which errors there are of the cases that both have estimated.
void check_which_errors(const PairedCases& cases, const std::vector<ColumnPair>& errors, Tally& missing,
                        Tally& added) {
  for (const auto& [b, f] : cases.rows) {
    if (!cases.base.is_estimated(b) || !cases.fresh.is_estimated(f)) continue;
    for (const ColumnPair& error : errors) {
      const bool before = error.base != nullptr && error.base->has(b),
                 after = error.fresh != nullptr && error.fresh->has(f);
      if (before == after) continue;
      const std::string what = fmt::format("{} {}", full_case(cases.base, b), error.name);
      if (before) missing.add(what, "there", "missing");
      if (after) added.add(what, "missing", "there");
    }
  }
}

/// One error of a subject that both sides have.
struct PairedErrors {
  const PairedCases& cases;
  const NumberColumn& base;
  const NumberColumn& fresh;
};

/// Fewer seeds cannot reach p = 0.05 by signed ranks.
constexpr size_t enough_seeds = 6;

/// Everything but the corrected p and the verdict; nothing where no case has it on both sides.
std::optional<AccuracyRow> measure(const PairedErrors& errors, const AccuracyPolicy& policy) {
  AccuracyRow row{.subject = errors.cases.base.subject, .metric = errors.base.name};
  const MetricPolicy rules = policy.of(row.metric);
  std::vector<double> differences;
  std::vector<uint64_t> clusters;
  double sum = 0;
  for (const auto& [b, f] : errors.cases.rows) {
    if (!errors.cases.base.is_estimated(b) || !errors.cases.fresh.is_estimated(f)) continue;
    if (!errors.base.has(b) || !errors.fresh.has(f)) continue;
    const double before = errors.base.numbers[b], after = errors.fresh.numbers[f];
    const bool changed =
        std::abs(after - before) > std::max(rules.absolute, rules.relative * std::abs(before));
    const double difference = changed ? after - before : 0;
    if (changed) ((difference > 0) == (rules.direction == Direction::lower) ? row.n_worse : row.n_better)++;
    differences.push_back(difference);
    clusters.push_back(errors.cases.base.seeds[b]);
    sum += before;
  }
  if (differences.empty()) return std::nullopt;
  row.n = static_cast<int>(differences.size());
  row.base = sum / row.n;
  PairedComparison& comparison = row;
  if (row.n_worse + row.n_better == 0) {
    comparison.interval = Interval{0, 0};
  } else {
    // What is independent: the seeds, which come in order; of too few seeds every case by itself.
    size_t n_seeds = 1;
    for (size_t i = 1; i < clusters.size(); ++i) n_seeds += clusters[i] != clusters[i - 1];
    if (n_seeds < enough_seeds) std::iota(clusters.begin(), clusters.end(), 0);
    comparison = compare_pairs(differences, clusters,
                               {.replicates = policy.replicates, .method = BootstrapMethod::percentile});
  }
  return row;
}

GateVerdict judge(const AccuracyRow& row, const AccuracyPolicy& policy) {
  const MetricPolicy rules = policy.of(row.metric);
  const double change =
      rules.direction == Direction::higher ? -row.difference : row.difference;  // above 0: worse
  if (row.n_worse + row.n_better == 0 || std::abs(change) <= rules.minimum_effect * std::abs(row.base))
    return GateVerdict::ok;
  const bool evidence = row.p_corrected && *row.p_corrected <= policy.alpha;
  if (change > 0) return evidence || row.n_better == 0 ? GateVerdict::regressed : GateVerdict::inconclusive;
  return evidence || row.n_worse == 0 ? GateVerdict::improved : GateVerdict::ok;
}

}  // namespace

AccuracyComparison compare_accuracy(const std::vector<SubjectCases>& base,
                                    const std::vector<SubjectCases>& fresh, const Policy& policy, int jobs) {
  AccuracyComparison out;
  Tally truth("data", policy.same.data), missing("cases", policy.same.cases),
      added("new_cases", policy.same.new_cases);
  const std::vector<PairedCases> shared = pair_up(base, fresh, policy.same, out.findings);
  std::vector<PairedErrors> tasks;
  for (const PairedCases& cases : shared) {
    out.n_cases += static_cast<int>(cases.rows.size());
    check_truth(cases, truth);
    const StatusRow statuses = compare_statuses(cases, policy.accuracy);
    if (!statuses.example.empty()) out.statuses.push_back(statuses);
    const std::vector<ColumnPair> errors = pair_columns(cases.base.errors, cases.fresh.errors);
    check_which_errors(cases, errors, missing, added);
    for (const auto& [name, before, after] : errors) {
      if (before != nullptr && after != nullptr && policy.accuracy.of(name).direction != Direction::ignore)
        tasks.push_back({cases, *before, *after});
    }
  }
  truth.move_to(out.findings);
  missing.move_to(out.findings);
  added.move_to(out.findings);
  std::vector<std::optional<AccuracyRow>> rows(tasks.size());
  parallel_for(static_cast<int>(tasks.size()), jobs, [&](int i) {
    rows[static_cast<size_t>(i)] = measure(tasks[static_cast<size_t>(i)], policy.accuracy);
  });
  for (std::optional<AccuracyRow>& row : rows) {
    if (row) out.rows.push_back(std::move(*row));
  }
  std::vector<AccuracyRow*> testable;
  for (AccuracyRow& row : out.rows) {
    const double attainable_p =
        std::min(1.0, std::ldexp(2.0, -row.n_used));  // Wilcoxon's smallest of n differences
    if (row.p && attainable_p <= policy.accuracy.alpha) testable.push_back(&row);
  }
  correct_by_holm(testable);
  for (AccuracyRow& row : out.rows) row.verdict = judge(row, policy.accuracy);
  return out;
}

}  // namespace sextant
