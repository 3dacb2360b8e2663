#include "sextant/eval/gate/record_pairs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

/// Pairs the records, and reports those that only one side has.
std::vector<PairedCases> pair_up(const Subjects& base, const Subjects& fresh, const SamenessPolicy& same,
                                 std::vector<Mismatch>& findings) {
  Tally missing("cases", same.cases), added("new_cases", same.new_cases);
  std::vector<PairedCases> shared;
  const auto pairs = by_key(base, fresh);
  report_noises(base, fresh, same.cases, findings);
  SubjectNames names;
  for (const auto& [subject, pair] : pairs) names.add(subject);
  for (const auto& [subject, pair] : pairs) {
    PairedRows rows = pair_rows(pair);
    const std::string name = names(subject);
    for (const size_t row : rows.only_base)
      missing.add(name + " " + case_name(*pair.base, row), "there", "missing");
    for (const size_t row : rows.only_fresh)
      added.add(name + " " + case_name(*pair.fresh, row), "missing", "there");
    if (!rows.both.empty()) shared.push_back({subject, *pair.base, *pair.fresh, name, std::move(rows.both)});
  }
  missing.move_to(findings);
  added.move_to(findings);
  return shared;
}

/// Reports values that depend on the truth only and differ between the sides.
void check_truth(const PairedCases& cases, Tally& truth) {
  constexpr double rounding = 1e-9;
  const auto columns = by_key(cases.base.truth, cases.fresh.truth);
  for (const RowPair& row : cases.rows) {
    for (const auto& [name, column] : columns) {
      const auto& [b, f] = row;
      const std::optional<double> before = number_at(column.base, b), after = number_at(column.fresh, f);
      const bool same =
          before.has_value() == after.has_value() &&
          (!before || std::abs(*before - *after) <= rounding * std::max(1.0, std::abs(*before)));
      if (same) continue;
      const auto text_of = [](const std::optional<double>& x) {
        return x ? fmt::format("{}", *x) : "missing";
      };
      truth.add(fmt::format("{} {}", cases.name_of(row), name), text_of(before), text_of(after));
    }
  }
}

/// Returns false if a finding explains why measurements differ: another configuration, or other data.
bool expects_equal_measurements(const std::vector<Mismatch>& findings) {
  return std::ranges::none_of(
      findings, [](const Mismatch& f) { return f.what == "configuration" || f.what == "data"; });
}

/// Reports errors of the measured flow that differ. They do not depend on the estimator, unlike the errors
/// over its inliers (epe_initial_px).
void check_measurements(const PairedCases& cases, const AccuracyPolicy& policy, Tally& measurements) {
  for (const auto& [name, column] : by_key(cases.base.errors, cases.fresh.errors)) {
    if (!name.str().starts_with("epe_measured_")) continue;
    const MetricPolicy rules = policy.of(name);
    for (const RowPair& row : cases.rows) {
      const auto numbers = numbers_at(column, row);
      if (!numbers || !rules.is_change(numbers->first, numbers->second)) continue;
      measurements.add(fmt::format("{} {}", cases.name_of(row), name), fmt::format("{}", numbers->first),
                       fmt::format("{}", numbers->second));
    }
  }
}

/// Sums of the NEES over the records that have one on both sides.
struct NeesSums {
  double base = 0, fresh = 0;
  int n = 0;
};

/// Reports estimators whose mean NEES differs. Errors alone do not show it if only the covariances of an
/// estimator have changed.
void report_covariances(const std::vector<PairedCases>& shared, const AccuracyPolicy& policy,
                        std::vector<Mismatch>& findings) {
  std::map<std::pair<std::string, bool>, NeesSums> sums;  // by estimator and whether the body is an object
  for (const PairedCases& cases : shared) {
    const OnBothSides<std::vector<double>> nees = {find_in(cases.base.values, "nees"),
                                                   find_in(cases.fresh.values, "nees")};
    for (const RowPair& row : cases.rows) {
      const auto numbers = numbers_at(nees, row);
      if (!numbers) continue;
      NeesSums& sum = sums[{cases.subject.estimator, cases.subject.body != "ego"}];
      sum.base += numbers->first;
      sum.fresh += numbers->second;
      ++sum.n;
    }
  }
  const MetricPolicy rules = policy.of("nees");
  const double least_change = std::max(rules.relative, rules.minimum_effect);
  Tally changed("covariances", Strictness::note);
  for (const auto& [of, sum] : sums) {
    if (std::abs(sum.fresh - sum.base) <= least_change * sum.base) continue;
    const auto mean = [n = sum.n](double total) { return fmt::format("{:.3g}", total / n); };
    changed.add(
        fmt::format("{}, {}: mean NEES (6 is consistent)", of.first, of.second ? "objects" : "camera"),
        mean(sum.base), mean(sum.fresh));
  }
  changed.move_to(findings);
}

/// Reports errors that only one side has, among the records that both have estimated.
void check_which_errors(const PairedCases& cases, Tally& missing, Tally& added) {
  const auto errors = by_key(cases.base.errors, cases.fresh.errors);
  for (const RowPair& row : cases.rows) {
    const auto& [b, f] = row;
    if (!cases.base.is_estimated(b) || !cases.fresh.is_estimated(f)) continue;
    for (const auto& [name, error] : errors) {
      const bool before = number_at(error.base, b).has_value(), after = number_at(error.fresh, f).has_value();
      if (before == after) continue;
      const std::string what = fmt::format("{} {}", cases.name_of(row), name);
      if (before) missing.add(what, "there", "missing");
      if (after) added.add(what, "missing", "there");
    }
  }
}

}  // namespace

std::vector<PairedCases> pair_records(const Subjects& base, const Subjects& fresh, const Policy& policy,
                                      std::vector<Mismatch>& findings) {
  Tally truth("data", policy.same.data), missing("cases", policy.same.cases),
      added("new_cases", policy.same.new_cases), measurements("measurements", Strictness::note);
  const bool equal_measurements = expects_equal_measurements(findings);
  std::vector<PairedCases> shared = pair_up(base, fresh, policy.same, findings);
  for (const PairedCases& cases : shared) {
    check_truth(cases, truth);
    if (equal_measurements) check_measurements(cases, policy.accuracy, measurements);
    check_which_errors(cases, missing, added);
  }
  for (Tally* tally : {&truth, &missing, &added, &measurements}) tally->move_to(findings);
  report_covariances(shared, policy.accuracy, findings);
  return shared;
}

}  // namespace sextant
