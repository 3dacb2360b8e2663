#include "sextant/eval/report/errors_by_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "sextant/base/machine.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/metrics/crlb.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

/// Returns the efficiency over the records that have error and bound; nullopt if there are none, or if all
/// errors are 0.
std::optional<Efficiency> efficiency(const ClusterSums& errors, const Moments& bounds,
                                     const BootstrapOptions& options) {
  const Moments all = total(errors);
  if (all.xx == 0) return std::nullopt;
  const std::vector<Moments> seeds = joined_sums(errors);
  const auto rms = [&](std::span<const size_t> chosen) { return total(seeds, chosen).rmse(); };
  Efficiency out{bounds.rmse(), bounds.rmse() / all.rmse(), std::nullopt};
  const std::optional<Interval> interval = cluster_bootstrap(seeds.size(), rms, options);
  if (interval && interval->low > 0) out.interval = {out.bound / interval->high, out.bound / interval->low};
  return out;
}

std::optional<Consistency> consistency(const Moments& nees) {
  if (nees.n == 0) return std::nullopt;
  const int n = static_cast<int>(nees.n);
  return Consistency{nees.mean(), nees_interval(n, nees_dof), n};
}

}  // namespace

IntervalEstimate Efficiency::ratio() const {
  IntervalEstimate out{1 / efficiency, std::nullopt};
  if (interval && interval->low > 0) out.interval = {1 / interval->high, 1 / interval->low};
  return out;
}

std::vector<const MetricDefinition*> bounded_errors() {
  std::vector<const MetricDefinition*> bounded = metrics_for(compared);
  std::erase_if(bounded, [](const MetricDefinition* m) { return !find_metric(NumberMap::bound, m->name); });
  return bounded;
}

LimitSummary summarize_limit(const NoiseLevel& level, const BootstrapOptions& options) {
  LimitSummary limit;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    const auto [errors, bounds] = level.bounded(e);
    if (const auto value = efficiency(errors, bounds, options))
      limit.efficiency[compared_errors()[e]->name] = *value;
  }
  limit.consistency = consistency(level.nees());
  return limit;
}

Fields<LimitSummary> limit_fields() {
  Fields<LimitSummary> fields;
  for (const MetricDefinition* error : bounded_errors()) {
    const std::string key = error->stem() + "_efficiency";
    Fields<Efficiency> of_error = {
        {Column::number(error->key("bound"), metric(NumberMap::bound, error->name).heading(),
                        error->digits + 1),
         &Efficiency::bound},
        {Column::number(key, "efficiency", 3), &Efficiency::efficiency}};
    of_error.add_range(range_columns(key + "_low", key + "_high", 3), &Efficiency::interval);
    fields.add(of_error,
               [name = error->name](const LimitSummary& limit) { return find_in(limit.efficiency, name); });
  }
  Fields<Consistency> anees = {{Column::number("anees", "ANEES", 2), &Consistency::anees}};
  anees.add_range(range_columns("anees_expected_low", "anees_expected_high", 2, "expected"),
                  [](const Consistency& c) { return &c.expected; });
  fields.add(anees, &LimitSummary::consistency);
  for (Field<LimitSummary>& field : fields) field.column.fold = true;
  return fields;
}

namespace {

NoiseLevelRow summarize_level(const std::string& parameter, const NoiseLevel& level,
                              const BootstrapOptions& options) {
  NoiseLevelRow row{CurveKey::of(parameter, level.key()), level.key().noise, level.key().level};
  row.n_seeds = static_cast<int>(level.n_seeds());
  row.n_truth = static_cast<int>(level.n_truth());
  row.n_estimated = static_cast<int>(level.n_estimated());
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    if (level.has(e))
      row.errors[compared_errors()[e]->name] = summarize_sample(level.sample(e, level.clusters()), options);
  }
  row.limit = summarize_limit(level, options);
  if (level.epe_initial_px().n > 0) row.epe_initial_px = level.epe_initial_px().mean();
  return row;
}

/// One statistic of SampleSummary. `detail`: it is shown in CSV and JSON only.
struct Statistic {
  IntervalEstimate SampleSummary::*member;
  const char* name;
  const char* title;
  bool detail = false;
};
constexpr std::array<Statistic, 7> statistics = {{{&SampleSummary::mean, "mean", "mean"},
                                                  {&SampleSummary::rmse, "rmse", "RMSE"},
                                                  {&SampleSummary::q05, "q05", "q05", true},
                                                  {&SampleSummary::q25, "q25", "q25", true},
                                                  {&SampleSummary::median, "median", "median"},
                                                  {&SampleSummary::q75, "q75", "q75", true},
                                                  {&SampleSummary::q95, "q95", "q95"}}};

/// Tables for readers show only the interval of the mean.
Fields<SampleSummary> statistic_fields(const MetricDefinition& error) {
  Fields<SampleSummary> fields;
  for (const Statistic& s : statistics) {
    const std::string name = s.name;
    const bool is_mean = s.member == &SampleSummary::mean;
    const Column column = Column::number(
        error.key(name), is_mean ? fmt::format("{} {} [{}]", error.symbol, s.title, error.unit) : s.title,
        error.digits + 1);
    Fields<IntervalEstimate> estimate = estimate_fields(s.detail ? column.only_in_files() : column,
                                                        error.key(name + "_low"), error.key(name + "_high"));
    for (size_t end : {1, 2}) estimate[end].column.detail = !is_mean;
    fields.add(estimate, [member = s.member](const SampleSummary& summary) { return &(summary.*member); });
  }
  return fields;
}

}  // namespace

std::vector<NoiseLevelRow> noise_levels(const NoiseSweep& sweep, int jobs, const BootstrapOptions& options) {
  std::vector<NoiseLevelRow> all(sweep.levels.size());
  parallel_for(static_cast<int>(all.size()), jobs, [&](int i) {
    const auto at = static_cast<size_t>(i);
    all[at] = summarize_level(sweep.parameter, *sweep.levels[at], options);
  });
  std::erase_if(all, [](const NoiseLevelRow& row) { return row.n_truth == 0; });
  return all;
}

Table noise_level_table(const std::vector<NoiseLevelRow>& rows) {
  using Row = NoiseLevelRow;
  Fields<Row> fields;
  fields.add(CurveKey::fields(), [](const Row& row) { return &row; });
  fields.add({{Column::number("level", 3), &Row::level},
              {Column::count("n_seeds", "seeds"), &Row::n_seeds},
              {Column::number("coverage_percent", "coverage [%]", 1),
               [](const Row& row) { return 100.0 * row.n_estimated / row.n_truth; }}});
  for (const MetricDefinition* error : compared_errors()) {
    fields.add(statistic_fields(*error),
               [name = error->name](const Row& row) { return find_in(row.errors, name); });
  }
  fields.add(Column::number("epe_initial_px", "EPE [px]", 3), &Row::epe_initial_px);
  fields.add(limit_fields(), [](const Row& row) { return &row.limit; });
  fields.add(Column::text("noise").only_in_files(), &Row::noise);
  return with_distinct(
      table_of(
          "Errors by noise level",
          "Over the estimated pairs of all seeds. Interval of the mean: bootstrap with a seed's pairs as one "
          "cluster (with one seed: frames). Objects: motion in the camera frame. Efficiency: Cramer-Rao "
          "bound (RMS) / RMSE, at most 1 except for a biased estimator or one that uses current depths; "
          "ANEES: mean normalised error squared, within its interval if the estimator's covariance is right. "
          "CSV and JSON have more quantiles and every interval.",
          fields, rows),
      {"level"});
}

namespace {

constexpr double alpha = 0.05;
constexpr double identical_below = 1e-9;  // m or deg: rounding of equal optima

/// Records of every estimator for one body at one level.
struct Level {
  const NoiseSweep* sweep = nullptr;
  std::map<Interned, const NoiseLevel*> by_estimator;
};
using RowPairs = std::vector<std::pair<size_t, size_t>>;

/// Tests the differences (second - first) of all pairs; labels[i] is the cluster of differences[i].
ErrorComparison test_differences(const std::vector<double>& differences, const std::vector<uint64_t>& labels,
                                 double mean_first, bool identical, const BootstrapOptions& options) {
  ErrorComparison out{compare_pairs(differences, labels, options), mean_first, identical};
  if (identical) out.p = 1;
  if (out.n_clusters < 2) out.p.reset();
  return out;
}

/// Makes the row of two levels; its errors and the parameter are added by the caller.
ComparisonRow row_without_errors(const NoiseLevel& first, const NoiseLevel& second, int n_pairs) {
  const NoiseLevelKey& key = first.key();
  return {.dataset = key.dataset,
          .sequence = key.sequence,
          .body = key.body,
          .noise = key.noise,
          .first = key.estimator,
          .second = second.key().estimator,
          .level = key.level,
          .n_pairs = n_pairs,
          .n_only_first = static_cast<int>(first.n_with_error()) - n_pairs,
          .n_only_second = static_cast<int>(second.n_with_error()) - n_pairs};
}

/// Compares one error over the pairs in which both records have it; nullopt if there are none.
std::optional<ErrorComparison> compare(const RowPairs& pairs, const NoiseLevel& first,
                                       const NoiseLevel& second, size_t error, ClusterBy by,
                                       const BootstrapOptions& options) {
  std::vector<double> of_first, differences;
  std::vector<uint64_t> labels;
  for (const auto& [a, b] : pairs) {
    const double before = first.error(error, a), difference = second.error(error, b) - before;
    if (std::isnan(difference)) continue;
    of_first.push_back(before);
    differences.push_back(difference);
    const auto [seed, frame] = first.case_of(a);
    labels.push_back(by == ClusterBy::seeds ? seed : static_cast<uint64_t>(frame));
  }
  if (differences.empty()) return std::nullopt;
  const auto is_rounding = [](double d) { return std::abs(d) <= identical_below; };
  return test_differences(differences, labels, mean(of_first), std::ranges::all_of(differences, is_rounding),
                          options);
}

/// Compares levels of summaries. The mean difference of a seed stands for each of its pairs, which does not
/// change any number of a comparison. Estimators are identical if mean and mean square agree up to rounding
/// for every seed.
std::optional<ErrorComparison> compare(const std::vector<NoiseLevel::SeedSums>& seeds,
                                       const BootstrapOptions& options) {
  std::vector<double> differences;
  std::vector<uint64_t> labels;
  Moments of_first;
  bool identical = true;
  for (const auto& [seed, first, second] : seeds) {
    const double difference = (second.x - first.x) / first.n;
    identical = identical && std::abs(difference) <= identical_below &&
                std::abs(second.xx - first.xx) <= 2 * identical_below * (first.x + second.x);
    differences.insert(differences.end(), static_cast<size_t>(first.n), difference);
    labels.insert(labels.end(), static_cast<size_t>(first.n), seed);
    of_first.add(first);
  }
  if (differences.empty()) return std::nullopt;
  return test_differences(differences, labels, of_first.mean(), identical, options);
}

/// Compares two levels of summaries. Returns nullopt if no pair was estimated by both, if the estimated pairs
/// differ, or if one level has records instead of summaries.
std::optional<ComparisonRow> compare_summed(const NoiseLevel& first, const NoiseLevel& second,
                                            const BootstrapOptions& options) {
  if (!first.is_summed() || !second.is_summed()) return std::nullopt;
  std::map<std::string, ErrorComparison> errors;
  int n_pairs = 0;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    const auto seeds = first.paired_sums(second, e);
    if (!seeds) return std::nullopt;
    if (auto c = compare(*seeds, options)) errors.emplace(compared_errors()[e]->name, std::move(*c));
    size_t n = 0;
    for (const NoiseLevel::SeedSums& seed : *seeds) n += static_cast<size_t>(seed.first.n);
    n_pairs = std::max(n_pairs, static_cast<int>(n));
  }
  if (n_pairs == 0) return std::nullopt;
  ComparisonRow row = row_without_errors(first, second, n_pairs);
  row.errors = std::move(errors);
  return row;
}

/// Compares two levels of records. Returns nullopt if no pair was estimated by both.
std::optional<ComparisonRow> compare(const NoiseLevel& first, const NoiseLevel& second,
                                     const BootstrapOptions& options) {
  const RowPairs pairs = first.pairs(second);
  if (pairs.empty()) return std::nullopt;
  ComparisonRow row = row_without_errors(first, second, static_cast<int>(pairs.size()));
  // The pairs are sorted, so there is one seed if the first and the last pair have the same.
  const bool one_seed = first.case_of(pairs.front().first).first == first.case_of(pairs.back().first).first;
  const ClusterBy by = one_seed ? ClusterBy::frames : ClusterBy::seeds;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    if (auto c = compare(pairs, first, second, e, by, options))
      row.errors.emplace(compared_errors()[e]->name, std::move(*c));
  }
  return row;
}

/// Returns the estimators in order of first appearance in the records of the sweeps.
std::vector<Interned> estimators_in_order(const std::vector<NoiseSweep>& sweeps) {
  std::vector<Interned> names;
  for (const NoiseSweep& sweep : sweeps) {
    for (const Interned name : sweep.estimators) add_distinct(name, names);
  }
  return names;
}

std::vector<Level> levels_of(const std::vector<NoiseSweep>& sweeps) {
  using Key = std::tuple<size_t, std::string, std::string, int, double, std::string>;
  std::map<Key, Level> levels;
  for (size_t s = 0; s < sweeps.size(); ++s) {
    for (const NoiseLevelRef& of : sweeps[s].levels) {
      const NoiseLevelKey& key = of->key();
      Level& level = levels[{s, key.dataset, key.sequence, body_order(key.body), key.level, key.noise}];
      level.sweep = &sweeps[s];
      level.by_estimator[key.estimator] = of.get();
    }
  }
  std::vector<Level> out;
  for (auto& [key, level] : levels) out.push_back(std::move(level));
  return out;
}

std::optional<double> percent(const ErrorComparison& comparison) {
  if (!(comparison.mean_first > 0)) return std::nullopt;
  return 100 * comparison.difference / comparison.mean_first;
}

void add_fields(const MetricDefinition& error, Fields<ComparisonRow>& fields) {
  const std::string stem = error.stem();
  const int decimals = error.digits + 1;
  Fields<ErrorComparison> of_error = {
      {Column::number(error.key("difference"), fmt::format("\u0394 {}", error.heading()), decimals),
       &ErrorComparison::difference}};
  of_error.add_range(range_columns(error.key("low"), error.key("high"), decimals),
                     &ErrorComparison::interval);
  of_error.add(
      {{Column::number(stem + "_difference_percent", "[%]", 1), percent},
       {Column::p_value(stem + "_p").only_in_files(), &ErrorComparison::p},
       {Column::p_value(stem + "_p_corrected"), &ErrorComparison::p_corrected},
       {Column::number(error.key("detectable"), "detectable", decimals), &ErrorComparison::detectable}});
  const auto find = [name = error.name](const ComparisonRow& row) { return find_in(row.errors, name); };
  fields.add(of_error, find);
  fields.add(Column::text(stem + "_verdict", "verdict"), [find](const ComparisonRow& row) {
    const ErrorComparison* comparison = find(row);
    return comparison != nullptr ? Cell(verdict(*comparison, row)) : Cell();
  });
}

}  // namespace

std::vector<ComparisonRow> compare_estimators(const std::vector<NoiseSweep>& sweeps, int jobs,
                                              const BootstrapOptions& options, size_t* n_left_out) {
  const std::vector<Interned> names = estimators_in_order(sweeps);
  const std::vector<Level> levels = levels_of(sweeps);
  std::vector<std::vector<ComparisonRow>> of_level(levels.size());
  std::vector<size_t> left_out(levels.size());
  parallel_for(static_cast<int>(levels.size()), jobs, [&](int i) {
    const Level& level = levels[static_cast<size_t>(i)];
    for (size_t a = 0; a < names.size(); ++a) {
      for (size_t b = a + 1; b < names.size(); ++b) {
        const auto first = level.by_estimator.find(names[a]);
        const auto second = level.by_estimator.find(names[b]);
        if (first == level.by_estimator.end() || second == level.by_estimator.end()) continue;
        const NoiseLevel& one = *first->second;
        const NoiseLevel& other = *second->second;
        const bool is_summed = one.is_summed() || other.is_summed();
        std::optional<ComparisonRow> row =
            is_summed ? compare_summed(one, other, options) : compare(one, other, options);
        if (!row && is_summed && one.n_with_error() > 0 && other.n_with_error() > 0)
          ++left_out[static_cast<size_t>(i)];
        if (!row) continue;
        row->parameter = level.sweep->parameter;
        of_level[static_cast<size_t>(i)].push_back(std::move(*row));
      }
    }
  });
  std::vector<ComparisonRow> rows;
  for (std::vector<ComparisonRow>& more : of_level) {
    std::move(more.begin(), more.end(), std::back_inserter(rows));
  }
  std::vector<ErrorComparison*> family;
  for (ComparisonRow& row : rows) {
    for (auto& [name, comparison] : row.errors) family.push_back(&comparison);
  }
  correct_by_holm(family);
  const auto n_tests = std::ranges::count_if(family, [](const auto* test) { return test->p.has_value(); });
  for (ErrorComparison* test : family)  // all clusters differ in the same direction
    test->smallest_p = static_cast<double>(n_tests) * std::ldexp(1.0, 1 - test->n_clusters);
  if (n_left_out != nullptr) *n_left_out = std::accumulate(left_out.begin(), left_out.end(), size_t{0});
  return rows;
}

std::string verdict(const ErrorComparison& comparison, const ComparisonRow& row) {
  if (comparison.identical) return "identical";
  const std::optional<Interval>& interval = comparison.interval;
  if (!comparison.p_corrected || !interval) return "too few clusters";
  if (interval->low <= 0 && interval->high >= 0) return "no difference seen";
  if (*comparison.p_corrected > alpha)
    return comparison.smallest_p > alpha ? "too few clusters" : "no difference seen";
  return (comparison.difference < 0 ? row.second : row.first) + " lower";
}

Table comparison_table(const std::vector<ComparisonRow>& rows) {
  using Row = ComparisonRow;
  Fields<Row> fields = {{Column::text("parameter").folded(), &Row::parameter},
                        {Column::text("dataset").folded(), &Row::dataset},
                        {Column::text("sequence").folded(), &Row::sequence},
                        {Column::text("first").folded(), &Row::first},
                        {Column::text("second").folded(), &Row::second},
                        {Column::text("body"), &Row::body},
                        {Column::number("level", 3), &Row::level},
                        {Column::count("n_pairs", "pairs"), &Row::n_pairs},
                        {Column::count("n_only_first", "only first").folded(), &Row::n_only_first},
                        {Column::count("n_only_second", "only second").folded(), &Row::n_only_second}};
  for (const MetricDefinition* error : compared_errors()) add_fields(*error, fields);
  fields.add(Column::text("noise").only_in_files(), &Row::noise);
  return with_distinct(
      table_of(
          "Estimators compared pair by pair",
          "Difference of the mean errors, second - first, over the pairs that both have estimated. Clusters "
          "of the intervals: seeds; with one seed frames. p: Wilcoxon's signed ranks on the clusters' means, "
          "corrected by Holm over the whole table. detectable: found at 5 % with probability 80 %. Too few "
          "clusters: the interval excludes 0, but so many comparisons of so few seeds cannot reach 5 %.",
          fields, rows),
      {"level"});
}

}  // namespace sextant
