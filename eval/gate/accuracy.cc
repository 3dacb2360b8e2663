#include "sextant/eval/gate/accuracy.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "sextant/base/parallel_for.h"

namespace sextant {
namespace {

struct Pair {
  const Record* base;
  const Record* fresh;
};

std::string short_case(const Record& r) { return fmt::format("seed {} frame {}", r.seed, r.frame); }

std::string full_case(const Record& r) {
  return fmt::format("{} {}", to_string(subject_of(r)), short_case(r));
}

/// Findings of one kind, of which the first few are told one by one.
class Tally {
 public:
  Tally(std::string what, Strictness rule) : what_(std::move(what)), rule_(rule) {}

  void add(const std::string& subject, const std::string& base, const std::string& fresh) {
    if (n_++ < shown) findings_.push_back(mismatch(rule_, what_, subject, base, fresh));
  }

  void move_to(std::vector<Mismatch>& all) {
    if (n_ > shown) findings_.push_back(mismatch(rule_, what_, fmt::format("{} more", n_ - shown), "", ""));
    std::ranges::move(findings_, std::back_inserter(all));
  }

 private:
  static constexpr size_t shown = 5;
  std::string what_;
  Strictness rule_;
  std::vector<Mismatch> findings_;
  size_t n_ = 0;
};

/// Pairs of the same subject, in order.
std::vector<std::vector<Pair>> pair_up(const std::vector<Record>& base, const std::vector<Record>& fresh,
                                       const SamenessPolicy& same, std::vector<Mismatch>& findings) {
  Tally missing("cases", same.cases), added("new_cases", same.new_cases);
  std::vector<std::vector<Pair>> subjects;
  auto b = base.begin(), f = fresh.begin();
  while (b != base.end() || f != fresh.end()) {
    const int order = b == base.end() ? 1 : (f == fresh.end() ? -1 : compare_cases(*b, *f));
    if (order < 0) {
      missing.add(full_case(*b++), "there", "missing");
    } else if (order > 0) {
      added.add(full_case(*f++), "missing", "there");
    } else {
      if (subjects.empty() || compare_subjects(*subjects.back().front().base, *b) != 0)
        subjects.emplace_back();
      subjects.back().push_back({&*b++, &*f++});
    }
  }
  missing.move_to(findings);
  added.move_to(findings);
  return subjects;
}

bool is_estimated(const Record& r) { return r.status == Status::ok || r.status == Status::no_truth; }

/// What the truth alone decides must not change.
void check_truth(const Pair& pair, Tally& truth) {
  constexpr double rounding = 1e-9;
  for (const MetricDefinition* metric : metrics_for(truth_only)) {
    const std::string& key = metric->name;
    const auto a = pair.base->values.find(key), b = pair.fresh->values.find(key);
    const bool in_a = a != pair.base->values.end(), in_b = b != pair.fresh->values.end();
    const bool same = in_a == in_b && (!in_a || std::abs(a->second - b->second) <=
                                                    rounding * std::max(1.0, std::abs(a->second)));
    if (same) continue;
    truth.add(fmt::format("{} {}", full_case(*pair.base), key),
              in_a ? fmt::format("{}", a->second) : "missing",
              in_b ? fmt::format("{}", b->second) : "missing");
  }
}

StatusRow compare_statuses(const std::vector<Pair>& pairs, const AccuracyPolicy& policy) {
  StatusRow row{.subject = subject_of(*pairs.front().base), .n = static_cast<int>(pairs.size())};
  for (const Pair& pair : pairs) {
    const bool before = is_estimated(*pair.base), after = is_estimated(*pair.fresh);
    if (pair.base->status == pair.fresh->status && pair.base->gate == pair.fresh->gate) continue;
    if (before && after) continue;  // ok and no_truth: see check_truth()
    (before ? row.n_lost : after ? row.n_gained : row.n_other)++;
    if (row.example.empty() || (before && row.n_lost == 1)) {
      row.example = fmt::format("{}: {} -> {}", short_case(*pair.base), to_string(pair.base->status),
                                to_string(pair.fresh->status));
    }
  }
  if (row.n_lost > row.n_gained + policy.max_lost) row.verdict = GateVerdict::regressed;
  if (row.n_gained > row.n_lost) row.verdict = GateVerdict::improved;
  return row;
}

/// Cases of one error that both sides have, and what differs in which errors there are.
std::map<std::string, std::vector<Pair>> pairs_by_metric(const std::vector<Pair>& pairs, Tally& missing,
                                                         Tally& added) {
  std::map<std::string, std::vector<Pair>> by_metric;
  for (const Pair& pair : pairs) {
    if (!is_estimated(*pair.base) || !is_estimated(*pair.fresh)) continue;
    for (const auto& [key, value] : pair.base->errors) {
      if (pair.fresh->errors.contains(key)) {
        by_metric[key].push_back(pair);
      } else {
        missing.add(fmt::format("{} {}", full_case(*pair.base), key), "there", "missing");
      }
    }
    for (const auto& [key, value] : pair.fresh->errors) {
      if (!pair.base->errors.contains(key))
        added.add(fmt::format("{} {}", full_case(*pair.base), key), "missing", "there");
    }
  }
  return by_metric;
}

/// Fewer seeds cannot reach p = 0.05 by signed ranks.
constexpr size_t enough_seeds = 6;

/// What is independent: the seeds; of too few seeds every case by itself.
std::vector<uint64_t> clusters_of(const std::vector<Pair>& pairs) {
  std::vector<uint64_t> seeds;
  for (const Pair& pair : pairs) seeds.push_back(pair.base->seed);
  if (std::set(seeds.begin(), seeds.end()).size() < enough_seeds) std::iota(seeds.begin(), seeds.end(), 0);
  return seeds;
}

/// Everything but the corrected p and the verdict.
AccuracyRow measure(const std::string& metric, const std::vector<Pair>& pairs, const AccuracyPolicy& policy) {
  const MetricPolicy rules = policy.of(metric);
  AccuracyRow row;
  std::vector<double> differences;
  double sum = 0;
  for (const Pair& pair : pairs) {
    const double before = pair.base->errors.at(metric), after = pair.fresh->errors.at(metric);
    const bool changed =
        std::abs(after - before) > std::max(rules.absolute, rules.relative * std::abs(before));
    const double difference = changed ? after - before : 0;
    if (changed) ((difference > 0) == (rules.direction == Direction::lower) ? row.n_worse : row.n_better)++;
    differences.push_back(difference);
    sum += before;
  }
  row.subject = subject_of(*pairs.front().base);
  row.metric = metric;
  row.n = static_cast<int>(pairs.size());
  row.base = sum / row.n;
  PairedComparison& comparison = row;
  if (row.n_worse + row.n_better == 0) {
    comparison.interval = Interval{0, 0};
  } else {
    comparison = compare_pairs(differences, clusters_of(pairs),
                               {.replicates = policy.replicates, .method = BootstrapMethod::percentile});
  }
  return row;
}

/// Smallest p that Wilcoxon's test can give to n differences.
double attainable_p(int n) { return std::min(1.0, std::ldexp(2.0, -n)); }

void correct(std::vector<AccuracyRow>& rows, double alpha) {
  std::vector<AccuracyRow*> testable;
  for (AccuracyRow& row : rows) {
    if (row.p && attainable_p(row.n_used) <= alpha) testable.push_back(&row);
  }
  correct_by_holm(testable);
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

Subject subject_of(const Record& r) { return {r.dataset, r.sequence, r.estimator, r.noise, r.body, r.level}; }

std::string to_string(const Subject& s) {
  const std::string level = s.noise == "none" ? "" : fmt::format(" level {}", s.level);
  return fmt::format("{} {} {}{} {}", s.dataset, s.sequence, s.estimator, level, s.body);
}

AccuracyComparison compare_accuracy(const std::vector<Record>& base, const std::vector<Record>& fresh,
                                    const Policy& policy, int jobs) {
  AccuracyComparison out;
  Tally truth("data", policy.same.data), missing("cases", policy.same.cases),
      added("new_cases", policy.same.new_cases);
  struct Task {
    std::string metric;
    std::vector<Pair> pairs;
  };
  std::vector<Task> tasks;
  for (const std::vector<Pair>& pairs : pair_up(base, fresh, policy.same, out.findings)) {
    out.n_cases += static_cast<int>(pairs.size());
    for (const Pair& pair : pairs) check_truth(pair, truth);
    const StatusRow statuses = compare_statuses(pairs, policy.accuracy);
    if (!statuses.example.empty()) out.statuses.push_back(statuses);
    for (auto& [metric, both] : pairs_by_metric(pairs, missing, added)) {
      if (policy.accuracy.of(metric).direction != Direction::ignore) tasks.push_back({metric, std::move(both)});
    }
  }
  truth.move_to(out.findings);
  missing.move_to(out.findings);
  added.move_to(out.findings);
  out.rows.resize(tasks.size());
  parallel_for(static_cast<int>(tasks.size()), jobs, [&](int i) {
    const Task& task = tasks[static_cast<size_t>(i)];
    out.rows[static_cast<size_t>(i)] = measure(task.metric, task.pairs, policy.accuracy);
  });
  correct(out.rows, policy.accuracy.alpha);
  for (AccuracyRow& row : out.rows) row.verdict = judge(row, policy.accuracy);
  return out;
}

}  // namespace sextant
