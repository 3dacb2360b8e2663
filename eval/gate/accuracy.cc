#include "sextant/eval/gate/accuracy.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

#include "sextant/base/machine.h"
#include "sextant/eval/gate/record_pairs.h"
#include "sextant/stats/paired_comparison.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

/// One error of a subject that both sides have.
struct PairedErrors {
  const PairedCases& cases;
  std::string metric;
  OnBothSides<std::vector<double>> numbers;
};

/// Returns the records that both sides have estimated, in order.
std::vector<ErrorPair> pairs_of(const PairedErrors& errors) {
  const SubjectCases &base = errors.cases.base, &fresh = errors.cases.fresh;
  std::vector<ErrorPair> pairs;
  for (const RowPair& row : errors.cases.rows) {
    const auto& [b, f] = row;
    const auto numbers = numbers_at(errors.numbers, row);
    if (base.is_estimated(b) && fresh.is_estimated(f) && numbers)
      pairs.push_back({base.case_of(b), numbers->first, numbers->second, base.lines[b], fresh.lines[f]});
  }
  return pairs;
}

/// One error of one subject; families and rows are judged from these.
struct MeasuredError {
  AccuracyRow row;     ///< without p_corrected and verdict
  int n_seeds = 0;     ///< number of seeds with different errors; 0 for the exact gate
  int n_frames = 0;    ///< as n_seeds
  PairedSample cases;  ///< empty for the exact gate
};

/// Computes the change of the mean error over these samples, with ratio_of_means(). A mean below
/// max(rules.absolute, 1e-12) is replaced by this value. `alpha` is the level of `detectable`.
RatioChange change_of(std::span<const PairedSample* const> samples, const MetricPolicy& rules, double alpha) {
  return ratio_of_means(samples, std::max(rules.absolute, 1e-12), alpha);
}

/// With fewer seeds the signed-rank test cannot reach p = 0.05.
constexpr size_t enough_seeds = 6;

/// A single frame does not show how much a change varies between frames.
constexpr int fewest_frames = 2;

/// Counts the seeds with distinct errors; records are in order of seed.
int count_different_seeds(const std::vector<PairedCase>& cases) {
  std::vector<std::pair<double, double>> sums;
  for (size_t i = 0; i < cases.size(); ++i) {
    if (i == 0 || cases[i].seed != cases[i - 1].seed) sums.emplace_back();
    sums.back().first += cases[i].base;
    sums.back().second += cases[i].fresh;
  }
  std::ranges::sort(sums);
  return static_cast<int>(std::unique(sums.begin(), sums.end()) - sums.begin());
}

int count_frames(const std::vector<PairedCase>& cases) {
  std::set<int> frames;
  for (const PairedCase& one : cases) frames.insert(one.frame);
  return static_cast<int>(frames.size());
}

/// Applies the tests of the exact gate to a row that changed.
PairedComparison compare_exactly(const std::vector<double>& differences, std::vector<uint64_t> clusters,
                                 const AccuracyPolicy& policy) {
  // The independent units are the seeds, which are in order; with too few seeds every record counts
  // separately.
  size_t n_seeds = 1;
  for (size_t i = 1; i < clusters.size(); ++i) n_seeds += clusters[i] != clusters[i - 1];
  if (n_seeds < enough_seeds) std::iota(clusters.begin(), clusters.end(), 0);
  return compare_pairs(differences, clusters,
                       {.replicates = policy.replicates, .method = BootstrapMethod::percentile});
}

/// Compares a row outside of the exact gate by ratio_of_means(), with the results in the unit of the error.
PairedComparison compare_by_seeds(const MeasuredError& error, const MetricPolicy& rules,
                                  const AccuracyPolicy& policy) {
  const double base = error.row.base;
  const PairedSample* sample = &error.cases;
  const RatioChange change = change_of(std::span(&sample, 1), rules, policy.alpha);
  PairedComparison out;
  out.difference = change.change * base;
  if (change.interval) out.interval = {change.interval->low * base, change.interval->high * base};
  out.n_clusters = out.n_used = error.n_seeds;
  out.p = change.p;
  if (change.detectable) out.detectable = *change.detectable * base;
  return out;
}

/// Compares one error; empty if no record has it on both sides.
std::optional<MeasuredError> measure(const PairedErrors& errors, size_t source,
                                     const AccuracyPolicy& policy) {
  const std::vector<ErrorPair> pairs = pairs_of(errors);
  if (pairs.empty()) return std::nullopt;
  MeasuredError out;
  AccuracyRow& row = out.row;
  row.subject = errors.cases.subject;
  row.metric = errors.metric;
  row.n = static_cast<int>(pairs.size());
  const MetricPolicy rules = policy.of(row.metric);
  const auto rise = [](const ErrorPair& pair) { return pair.fresh - pair.base; };
  row.most_worse = *std::ranges::max_element(pairs, {}, rise);
  row.most_better = *std::ranges::min_element(pairs, {}, rise);
  if (rules.direction == Direction::higher) std::swap(row.most_worse, row.most_better);
  std::vector<double> differences;
  std::vector<uint64_t> clusters;
  PairedSample sample{source, {}};
  for (const ErrorPair& pair : pairs) {
    const bool changed = rules.is_change(pair.base, pair.fresh);
    const double difference = changed ? rise(pair) : 0;
    if (changed) ((difference > 0) == (rules.direction == Direction::lower) ? row.n_worse : row.n_better)++;
    differences.push_back(difference);
    clusters.push_back(pair.at.first);
    sample.cases.push_back({pair.at.first, pair.at.second, pair.base, pair.base + difference});
    row.base += pair.base;
  }
  row.base /= row.n;
  PairedComparison& comparison = row;
  if (!row.is_changed()) comparison.interval = Interval{0, 0};
  if (rules.minimum_effect == 0) {
    if (row.is_changed()) comparison = compare_exactly(differences, std::move(clusters), policy);
    return out;
  }
  out.cases = std::move(sample);
  out.n_seeds = count_different_seeds(out.cases.cases);
  out.n_frames = count_frames(out.cases.cases);
  if (row.is_changed()) comparison = compare_by_seeds(out, rules, policy);
  row.too_few =
      out.n_seeds < policy.minimum_seeds || out.n_frames < fewest_frames || row.n < policy.minimum_cases;
  return out;
}

/// Positive if the row is worse in NEW.
double worsening(const AccuracyRow& row, const MetricPolicy& rules) {
  return rules.direction == Direction::higher ? -row.difference : row.difference;
}

bool is_too_small(const AccuracyRow& row, const MetricPolicy& rules) {
  return !row.is_changed() || std::abs(row.difference) <= rules.minimum_effect * std::abs(row.base);
}

/// Returns true if the corrected p-value of a row proves its change.
template <typename Row>
bool is_significant(const Row& row, const AccuracyPolicy& policy) {
  return row.p_corrected && *row.p_corrected <= policy.alpha;
}

/// Removes the p-values of a row if its verdict `regressed` or `improved` does not follow from them.
template <typename Row>
void remove_unused_p(const AccuracyPolicy& policy, Row& row) {
  const bool decided = row.verdict == GateVerdict::regressed || row.verdict == GateVerdict::improved;
  if (decided && !is_significant(row, policy)) row.p = row.p_corrected = std::nullopt;
}

GateVerdict judge(const AccuracyRow& row, const AccuracyPolicy& policy) {
  const MetricPolicy rules = policy.of(row.metric);
  if (is_too_small(row, rules) || row.too_few) return GateVerdict::ok;
  const bool exact = rules.minimum_effect == 0;
  const bool evidence = is_significant(row, policy);
  if (worsening(row, rules) > 0) {
    if (evidence || (exact && row.n_better == 0)) return GateVerdict::regressed;
    return exact ? GateVerdict::inconclusive : GateVerdict::ok;
  }
  if (evidence || (exact && row.n_worse == 0)) return GateVerdict::improved;
  return exact && row.n_worse > row.n_better ? GateVerdict::inconclusive : GateVerdict::ok;
}

/// Judges all rows together, since Holm's correction needs every p-value.
void judge_rows(const AccuracyPolicy& policy, std::vector<AccuracyRow>& rows) {
  std::vector<AccuracyRow*> testable;
  for (AccuracyRow& row : rows) {
    const double attainable_p = std::min(
        1.0,
        std::ldexp(2.0, -row.n_used));  // smallest p-value that Wilcoxon's test reaches with n differences
    const bool exact = policy.of(row.metric).minimum_effect == 0;
    if (row.p && !row.too_few && (!exact || attainable_p <= policy.alpha)) testable.push_back(&row);
  }
  correct_by_holm(testable);
  for (AccuracyRow& row : rows) {
    row.verdict = judge(row, policy);
    row.too_few = row.too_few && !is_too_small(row, policy.of(row.metric));
    remove_unused_p(policy, row);
  }
}

using Members = std::vector<const MeasuredError*>;

/// Selects the members with enough seeds and frames; all members if none has enough.
Members judged_members(const Members& all, const AccuracyPolicy& policy) {
  Members judged;
  std::ranges::copy_if(all, std::back_inserter(judged), [&](const MeasuredError* error) {
    return error->n_seeds >= policy.minimum_seeds && error->n_frames >= fewest_frames;
  });
  return judged.empty() ? all : judged;
}

/// Returns true if the typical record got worse by more than a quarter: the median of the log ratios, by
/// Wilcoxon's test of the medians of the seeds and of those of the frames. A few large errors, which decide a
/// mean, have no weight in it.
bool is_typically_worse(std::span<const PairedSample* const> samples, const MetricPolicy& rules,
                        const AccuracyPolicy& policy) {
  constexpr double least_change = 0.25, largest_p_of_frames = 0.05;  // six frames reach 0.03
  std::map<std::pair<size_t, uint64_t>, std::vector<double>> by_seed, by_frame;
  std::vector<double> all;
  for (const PairedSample* sample : samples) {
    for (const PairedCase& one : sample->cases) {
      if (!(one.base > 0 && one.fresh > 0)) continue;
      const double ratio = std::log(one.fresh / one.base);
      all.push_back(rules.direction == Direction::higher ? -ratio : ratio);
      by_seed[{sample->stratum, one.seed}].push_back(all.back());
      by_frame[{sample->stratum, static_cast<uint64_t>(one.frame)}].push_back(all.back());
    }
  }
  if (all.empty() || median(all) <= std::log1p(least_change)) return false;
  const auto is_worse = [](const auto& clusters, double largest_p) {
    std::vector<double> medians;
    for (const auto& [key, ratios] : clusters) medians.push_back(median(ratios));
    return median(medians) > 0 && wilcoxon_test(medians).p <= largest_p;
  };
  return is_worse(by_seed, policy.alpha) && is_worse(by_frame, largest_p_of_frames);
}

/// Pools one error. `n_tests` is the number of errors that are judged together, for `detectable`.
FamilyRow pool(const Members& members, int n_tests, const AccuracyPolicy& policy) {
  const AccuracyRow& first = members.front()->row;
  const MetricPolicy rules = policy.of(first.metric);
  FamilyRow row;
  row.estimator = first.subject.estimator;
  row.body = first.subject.body == "ego" ? "camera" : "objects";
  row.metric = first.metric;
  row.n_seeds = members.front()->n_seeds;
  std::set<size_t> sources;
  std::set<std::pair<size_t, int>> changed_frames;
  int fewest_of_member = members.front()->n_frames;
  for (const MeasuredError* member : members) {
    for (const PairedCase& one : member->cases.cases) {
      if (one.fresh != one.base) changed_frames.emplace(member->cases.stratum, one.frame);
    }
    fewest_of_member = std::min(fewest_of_member, member->n_frames);
    row.n += member->row.n;
    row.n_worse += member->row.n_worse;
    row.n_better += member->row.n_better;
    row.n_seeds = std::min(row.n_seeds, member->n_seeds);
    sources.insert(member->cases.stratum);
  }
  row.n_sources = static_cast<int>(sources.size());
  row.n_changed_frames = static_cast<int>(changed_frames.size());
  row.too_few =
      row.n_seeds < policy.minimum_seeds || fewest_of_member < fewest_frames || row.n < policy.minimum_cases;
  if (!row.is_changed()) {
    row.interval = Interval{0, 0};
    return row;
  }
  std::vector<const PairedSample*> samples;
  for (const MeasuredError* member : members) samples.push_back(&member->cases);
  static_cast<RatioChange&>(row) = change_of(samples, rules, policy.alpha / n_tests);
  row.worse = rules.direction == Direction::higher ? -row.change : row.change;
  row.typically_worse = is_typically_worse(samples, rules, policy);
  return row;
}

GateVerdict judge(const FamilyRow& row, const AccuracyPolicy& policy) {
  const bool evidence = is_significant(row, policy);
  const GateVerdict unproven = row.typically_worse ? GateVerdict::inconclusive : GateVerdict::ok;
  if (!row.is_changed() || std::abs(row.worse) <= policy.of(row.metric).minimum_effect) return unproven;
  const int n_for = row.worse > 0 ? row.n_worse : row.n_better,
            n_against = row.worse > 0 ? row.n_better : row.n_worse;
  // A small change of a frame in all seeds alike is one observation.
  constexpr double large = 0.5;
  const double p_of_frames = std::ldexp(2.0, -row.n_changed_frames);
  const bool unanimous = n_against == 0 && n_for >= policy.minimum_cases &&
                         (p_of_frames <= policy.alpha || std::abs(row.worse) > large);
  const bool proven = unanimous || (evidence && !row.too_few);
  if (row.worse < 0) return proven ? GateVerdict::improved : unproven;
  if (proven) return GateVerdict::regressed;
  const bool suspicious = row.too_few && (evidence || n_against == 0);
  return suspicious || row.worse > policy.inconclusive_effect ? GateVerdict::inconclusive : unproven;
}

/// Judges the metrics whose minimum_effect is above 0; the exact gate judges every row separately. Returns
/// families with the worst verdict first; families of equal verdict with the largest worsening first, or with
/// the largest improvement first if they are improved.
std::vector<FamilyRow> judge_families(const std::vector<MeasuredError>& errors,
                                      const AccuracyPolicy& policy) {
  std::map<std::tuple<std::string, bool, std::string>, Members>
      families;  // key: estimator, objects or camera, metric
  for (const MeasuredError& error : errors) {
    const auto& [subject, metric] = std::tie(error.row.subject, error.row.metric);
    if (policy.of(metric).minimum_effect > 0)
      families[{subject.estimator, subject.body != "ego", metric}].push_back(&error);
  }
  std::map<bool, int> n_tests;  // by whether the body is an object, as Holm's correction counts them
  for (const auto& [key, all] : families) {
    const auto is_changed = [](const MeasuredError* error) { return error->row.is_changed(); };
    n_tests[std::get<1>(key)] += std::ranges::any_of(all, is_changed) ? 1 : 0;
  }
  std::vector<FamilyRow> rows;
  std::vector<FamilyRow> with_few_seeds;
  for (const auto& [key, all] : families) {
    const int n = std::max(1, n_tests[std::get<1>(key)]);
    const Members members = judged_members(all, policy);
    rows.push_back(pool(members, n, policy));
    Members others;
    std::ranges::set_difference(all, members, std::back_inserter(others));
    if (!others.empty()) with_few_seeds.push_back(pool(others, n, policy));
  }
  for (const char* body : {"camera", "objects"}) {
    std::vector<FamilyRow*> together;
    for (FamilyRow& row : rows) {
      if (row.body == body) together.push_back(&row);
    }
    correct_by_holm(together);
  }
  for (FamilyRow& row : rows) row.verdict = judge(row, policy);
  // Levels without noise and rare bodies prove a change only by all of their records.
  for (FamilyRow& row : with_few_seeds) {
    row.p = std::nullopt;
    row.verdict = judge(row, policy);
    if (row.verdict != GateVerdict::regressed) continue;
    row.body += " with few seeds";
    rows.push_back(std::move(row));
  }
  for (FamilyRow& row : rows) remove_unused_p(policy, row);
  std::ranges::stable_sort(rows, {}, [](const FamilyRow& row) {
    return std::pair(row.verdict, row.verdict == GateVerdict::improved ? row.worse : -row.worse);
  });
  return rows;
}

}  // namespace

std::string JudgedError::word() const {
  return too_few && verdict == GateVerdict::ok ? "too few to judge" : std::string(to_string(verdict));
}

GateVerdict AccuracyComparison::worst_verdict() const {
  GateVerdict worst = GateVerdict::ok;
  for (const Mismatch& f : findings) worst = f.invalidates ? GateVerdict::invalid : worst;
  for (const FamilyRow& row : families) worst = std::min(worst, row.verdict);
  for (const AccuracyRow& row : accuracy) worst = std::min(worst, row.verdict);
  for (const StatusRow& row : statuses) worst = std::min(worst, row.verdict);
  return worst;
}

void compare_accuracy(const Subjects& base, const Subjects& fresh, const Policy& policy, int jobs,
                      AccuracyComparison& out) {
  const std::vector<PairedCases> shared = pair_records(base, fresh, policy, out.findings);
  std::vector<PairedErrors> tasks;
  for (const PairedCases& cases : shared) {
    out.n_cases += static_cast<int>(cases.rows.size());
    for (const auto& [name, numbers] : by_key(cases.base.errors, cases.fresh.errors)) {
      if (numbers.base && numbers.fresh && policy.accuracy.of(name).direction != Direction::ignore)
        tasks.push_back({cases, name, numbers});
    }
  }
  if (!policy.accuracy.judge) return;
  out.statuses = compare_statuses(shared, policy.accuracy);
  std::vector<size_t> sources;
  std::map<std::pair<std::string, std::string>, size_t> known;
  for (const PairedErrors& task : tasks) {
    const Subject& subject = task.cases.subject;
    sources.push_back(known.try_emplace({subject.dataset, subject.sequence}, known.size()).first->second);
  }
  std::vector<std::optional<MeasuredError>> measured(tasks.size());
  parallel_for(static_cast<int>(tasks.size()), jobs, [&](int task) {
    const auto i = static_cast<size_t>(task);
    measured[i] = measure(tasks[i], sources[i], policy.accuracy);
  });
  std::vector<MeasuredError> errors;
  for (std::optional<MeasuredError>& one : measured) {
    if (one) errors.push_back(std::move(*one));
  }
  out.families = judge_families(errors, policy.accuracy);
  for (MeasuredError& error : errors) out.accuracy.push_back(std::move(error.row));
  judge_rows(policy.accuracy, out.accuracy);
}

}  // namespace sextant
