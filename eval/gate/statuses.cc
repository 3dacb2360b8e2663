#include "sextant/eval/gate/statuses.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "sextant/stats/tests.h"

namespace sextant {
namespace {

/// Records of a subject that got worse (lost, wrong) and better (gained, corrected) by seed.
struct CountsBySeed {
  std::map<uint64_t, int> net;  ///< worse less better, of every seed of the subject
  int n_worse = 0, n_better = 0;

  void add(uint64_t seed, int worse, int better) {
    net[seed] += worse - better;
    n_worse += worse;
    n_better += better;
  }
  void add(const CountsBySeed& other) {
    for (const auto& [seed, n] : other.net) net[seed] += n;
    n_worse += other.n_worse;
    n_better += other.n_better;
  }
  bool got_worse() const { return n_worse > n_better; }
  /// The larger p of the sign test of the records and of Wilcoxon's test of the seeds, since the records of a
  /// seed may depend on each other. That of the records is multiplied by the number of tests.
  double p(size_t n_tests) const {
    std::vector<double> differences;
    for (const auto& [seed, n] : net) differences.push_back(n);
    if (differences.empty()) return 1;
    const double of_records = std::min(1.0, sign_test(n_worse, n_better) * static_cast<double>(n_tests));
    return std::max(of_records, wilcoxon_test(differences).p);
  }
};

/// Counts of all subjects of a family: the camera, or the objects, of an estimator.
struct FamilyCounts {
  CountsBySeed all;
  size_t n_subjects = 0;               ///< with changes
  size_t n_compared = 0, n_other = 0;  ///< records estimated on both sides; of these, with another error

  void add(const CountsBySeed& counts, size_t compared, size_t other) {
    all.add(counts);
    n_subjects += counts.n_worse + counts.n_better > 0;
    n_compared += compared;
    n_other += other;
  }
  /// Returns true if most errors are other numbers, as those of an estimator with random numbers of its own.
  bool has_other_numbers() const { return 2 * n_other > n_compared; }
};

/// Finds the records that both sides have estimated and of which an error changed by more than rounding.
class OtherErrors {
 public:
  OtherErrors(const PairedCases& cases, const AccuracyPolicy& policy) {
    for (const auto& [name, numbers] : by_key(cases.base.errors, cases.fresh.errors))
      errors_.emplace_back(numbers, policy.of(name));
  }
  bool contain(const RowPair& row) const {
    return std::ranges::any_of(errors_, [&row](const auto& error) {
      const auto numbers = numbers_at(error.first, row);
      return numbers && error.second.is_change(numbers->first, numbers->second);
    });
  }

 private:
  std::vector<std::pair<OnBothSides<std::vector<double>>, MetricPolicy>> errors_;
};

/// Judges the counts of a subject of the family.
GateVerdict judge_counts(const CountsBySeed& counts, const FamilyCounts& family,
                         const AccuracyPolicy& policy) {
  constexpr double suspicious_p = 0.05;
  const bool is_worse = counts.n_worse > counts.n_better + policy.max_lost;
  if (!is_worse && counts.n_better <= counts.n_worse) return GateVerdict::ok;
  const CountsBySeed& all = family.all;
  const bool all_agree = (is_worse ? all.n_better : all.n_worse) == 0 && !family.has_other_numbers();
  const double p = std::min(counts.p(family.n_subjects), all.got_worse() == is_worse ? all.p(1) : 1.0);
  if (all_agree || p <= policy.alpha) return is_worse ? GateVerdict::regressed : GateVerdict::improved;
  if (!is_worse) return GateVerdict::ok;
  const double attainable_p = std::ldexp(2.0, -static_cast<int>(counts.net.size()));
  const bool too_few = attainable_p > policy.alpha && counts.n_worse > 2 * counts.n_better;
  return too_few || p <= suspicious_p ? GateVerdict::inconclusive : GateVerdict::ok;
}

/// Adds the decisions between dynamic and static that differ. Like the counts of a report, the judged ones do
/// not include records that are gated for another reason: their decision has no effect. A decision that only
/// one side made is listed if the statuses are equal; otherwise it is missing because of the status.
void compare_decisions(const PairedCases& cases, StatusRow& row, CountsBySeed& counts) {
  const SubjectCases &base = cases.base, &fresh = cases.fresh;
  const std::vector<double>*before = find_in(base.values, "dynamic"),
        *after = find_in(fresh.values, "dynamic"), *truth = find_in(base.truth, "dynamic_gt");
  const auto word = [](std::optional<double> dynamic) {
    return !dynamic ? "undecided" : *dynamic == 0 ? "static" : "dynamic";
  };
  for (const auto& [b, f] : cases.rows) {
    const std::optional<double> was = number_at(before, b), is = number_at(after, f),
                                right = number_at(truth, b);
    if (was == is) continue;
    if ((!was || !is) && (base.statuses[b] != fresh.statuses[f] || base.gates[b] != fresh.gates[f])) continue;
    const bool is_judged = was && is && right && base.has_decision(b) && fresh.has_decision(f);
    (!is_judged ? row.n_other : is == right ? row.n_corrected : row.n_wrong)++;
    if (is_judged) counts.add(base.seeds[b], is != right, is == right);
    const bool is_first_wrong = row.n_lost == 0 && row.n_wrong == 1 && is_judged && is != right;
    if (row.example.empty() || is_first_wrong) {
      row.example = fmt::format("{}: {} -> {}{}", case_name(base, b), word(was), word(is),
                                right ? fmt::format(", truly {}", word(right)) : "");
    }
  }
}

/// Finds the records that only NEW has estimated, with an error that exceeds the largest one of the subject
/// in BASE by the factor of the policy.
class ImplausibleGains {
 public:
  ImplausibleGains(const PairedCases& cases, const AccuracyPolicy& policy) {
    for (const auto& [name, numbers] : by_key(cases.base.errors, cases.fresh.errors)) {
      if (!numbers.base || !numbers.fresh || policy.of(name).direction != Direction::lower) continue;
      std::optional<double> largest;
      for (const RowPair& row : cases.rows) {
        const auto before =
            cases.base.is_estimated(row.base) ? number_at(numbers.base, row.base) : std::nullopt;
        if (before) largest = std::max(largest.value_or(policy.of(name).absolute), *before);
      }
      if (largest) limits_.emplace_back(numbers.fresh, policy.gained_error * *largest);
    }
  }
  bool contain(size_t row) const {
    return std::ranges::any_of(limits_, [&](const auto& limit) {
      const auto error = number_at(limit.first, row);
      return error && *error > limit.second;
    });
  }

 private:
  /// Errors in NEW, and the largest one that is a gain
  std::vector<std::pair<const std::vector<double>*, double>> limits_;
};

/// Changes of the statuses and decisions of a subject; the verdict is judged with those of its family.
struct ComparedStatuses {
  StatusRow row;
  CountsBySeed statuses, decisions;
  size_t n_compared = 0, n_other_errors = 0;  ///< FamilyCounts::n_compared, n_other
};

ComparedStatuses compare(const PairedCases& cases, const AccuracyPolicy& policy) {
  const SubjectCases &base = cases.base, &fresh = cases.fresh;
  ComparedStatuses out;
  StatusRow& row = out.row;
  row.subject = cases.subject;
  row.n = static_cast<int>(cases.rows.size());
  const ImplausibleGains implausible(cases, policy);
  const OtherErrors other(cases, policy);
  const std::vector<double>* true_decisions = find_in(base.truth, "dynamic_gt");
  for (const auto& [b, f] : cases.rows) {
    const bool is_static = number_at(true_decisions, b) == 0;
    const bool before = base.is_estimated(b), after = fresh.is_estimated(f);
    if (before && after) {
      ++out.n_compared;
      out.n_other_errors += other.contain({b, f});
    }
    out.statuses.add(base.seeds[b], 0, 0);
    out.decisions.add(base.seeds[b], 0, 0);
    if (base.statuses[b] == fresh.statuses[f] && base.gates[b] == fresh.gates[f]) continue;
    if (before && after)
      continue;       // between ok and no_truth only the truth changed: check_truth() reports it
    if (is_static) {  // counts in no coverage; its decision is judged
      row.n_other++;
      if (row.example.empty())
        row.example = fmt::format("{}: {} -> {}, static by truth", case_name(base, b),
                                  to_string(base.statuses[b]), to_string(fresh.statuses[f]));
      continue;
    }
    const bool is_bad = !before && after && implausible.contain(f);
    (before ? row.n_lost : is_bad ? row.n_bad : after ? row.n_gained : row.n_other)++;
    out.statuses.add(base.seeds[b], before || is_bad, !before && after && !is_bad);
    const bool is_first_lost = before && row.n_lost == 1, is_first_bad = is_bad && row.n_bad == 1;
    if (row.example.empty() || is_first_lost || (is_first_bad && row.n_lost == 0)) {
      row.example = fmt::format("{}: {} -> {}{}", case_name(base, b), to_string(base.statuses[b]),
                                to_string(fresh.statuses[f]), is_bad ? ", with a gross error" : "");
    }
  }
  compare_decisions(cases, row, out.decisions);
  return out;
}

}  // namespace

std::vector<StatusRow> compare_statuses(const std::vector<PairedCases>& shared,
                                        const AccuracyPolicy& policy) {
  std::vector<ComparedStatuses> all;
  std::map<std::pair<std::string, bool>, std::pair<FamilyCounts, FamilyCounts>> families;
  const auto family_of = [&](const ComparedStatuses& one) -> auto& {
    return families[{one.row.subject.estimator, one.row.subject.body == "ego"}];
  };
  for (const PairedCases& cases : shared) {
    const ComparedStatuses& one = all.emplace_back(compare(cases, policy));
    family_of(one).first.add(one.statuses, one.n_compared, one.n_other_errors);
    family_of(one).second.add(one.decisions, one.n_compared, one.n_other_errors);
  }
  std::vector<StatusRow> rows;
  for (ComparedStatuses& one : all) {
    StatusRow& row = one.row;
    if (row.example.empty()) continue;
    const auto& [statuses, decisions] = family_of(one);
    row.verdict = std::min(judge_counts(one.statuses, statuses, policy),
                           judge_counts(one.decisions, decisions, policy));
    constexpr double expected_by_chance = 3;  // of common records
    const double n_common = static_cast<double>(row.n_lost) * (row.n_gained + row.n_bad) / row.n;
    if (one.n_compared == 0 && n_common >= expected_by_chance)
      row.verdict = std::min(row.verdict, GateVerdict::inconclusive);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace sextant
