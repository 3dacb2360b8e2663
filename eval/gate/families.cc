#include "sextant/eval/gate/families.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "sextant/eval/records/record.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {
namespace {

using Members = std::vector<const PairedError*>;

/// Selects the members with enough seeds; all members if none has enough.
Members judged_members(const Members& all, const AccuracyPolicy& policy) {
  Members judged;
  std::ranges::copy_if(all, std::back_inserter(judged),
                       [&](const PairedError* error) { return error->n_seeds >= policy.minimum_seeds; });
  return judged.empty() ? all : judged;
}

FamilyRow pool(const Members& all, const AccuracyPolicy& policy) {
  const Members members = judged_members(all, policy);
  const PairedError& first = *members.front();
  const MetricPolicy rules = policy.of(first.metric);
  FamilyRow row;
  row.estimator = first.subject.estimator;
  row.body = first.subject.body == "ego" ? "camera" : "objects";
  row.metric = first.metric;
  row.n_seeds = first.n_seeds;
  std::set<size_t> sources;
  for (const PairedError* member : members) {
    row.n += member->n;
    row.n_worse += member->n_worse;
    row.n_better += member->n_better;
    row.n_seeds = std::min(row.n_seeds, member->n_seeds);
    sources.insert(member->cases.stratum);
  }
  row.n_sources = static_cast<int>(sources.size());
  row.too_few = row.n_seeds < policy.minimum_seeds || row.n < policy.minimum_cases;
  if (!row.is_changed()) {
    row.interval = Interval{0, 0};
    return row;
  }
  std::vector<const PairedSample*> samples;
  for (const PairedError* member : members) samples.push_back(&member->cases);
  static_cast<RatioChange&>(row) = change_of(samples, rules, policy);
  row.worse = rules.direction == Direction::higher ? -row.change : row.change;
  return row;
}

GateVerdict judge(const FamilyRow& row, const AccuracyPolicy& policy) {
  const bool evidence = row.p_corrected && *row.p_corrected <= policy.alpha;
  if (!row.is_changed() || std::abs(row.worse) <= policy.of(row.metric).minimum_effect)
    return GateVerdict::ok;
  const int n_for = row.worse > 0 ? row.n_worse : row.n_better,
            n_against = row.worse > 0 ? row.n_better : row.n_worse;
  const bool unanimous = n_against == 0 && n_for >= policy.minimum_cases;
  const bool proven = unanimous || (evidence && !row.too_few);
  if (row.worse < 0) return proven ? GateVerdict::improved : GateVerdict::ok;
  if (proven) return GateVerdict::regressed;
  const bool suspicious = row.too_few && (evidence || n_against == 0);
  return suspicious || row.worse > policy.inconclusive_effect ? GateVerdict::inconclusive : GateVerdict::ok;
}

}  // namespace

std::string JudgedError::word() const {
  return too_few && verdict == GateVerdict::ok ? "too few to judge" : std::string(to_string(verdict));
}

RatioChange change_of(std::span<const PairedSample* const> samples, const MetricPolicy& rules,
                      const AccuracyPolicy& policy) {
  return ratio_of_means(samples, std::max(rules.absolute, 1e-12), {.alpha = policy.alpha});
}

std::vector<FamilyRow> judge_families(const std::vector<PairedError>& errors, const AccuracyPolicy& policy) {
  std::map<std::tuple<std::string, bool, std::string>, Members>
      families;  // key: estimator, objects or camera, metric
  for (const PairedError& error : errors) {
    if (policy.of(error.metric).minimum_effect > 0)
      families[{error.subject.estimator, error.subject.body != "ego", error.metric}].push_back(&error);
  }
  std::vector<FamilyRow> rows;
  for (const auto& [key, members] : families) rows.push_back(pool(members, policy));
  for (const char* body : {"camera", "objects"}) {
    std::vector<FamilyRow*> together;
    for (FamilyRow& row : rows) {
      if (row.body == body) together.push_back(&row);
    }
    correct_by_holm(together);
  }
  for (FamilyRow& row : rows) {
    row.verdict = judge(row, policy);
    // A p-value that did not decide is not shown beside a verdict.
    const bool decided = row.verdict == GateVerdict::regressed || row.verdict == GateVerdict::improved;
    if (decided && !(row.p_corrected && *row.p_corrected <= policy.alpha))
      row.p = row.p_corrected = std::nullopt;
  }
  std::ranges::stable_sort(rows, {}, [](const FamilyRow& row) {
    return std::pair(row.verdict, row.verdict == GateVerdict::improved ? row.worse : -row.worse);
  });
  return rows;
}

}  // namespace sextant
