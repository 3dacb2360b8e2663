#include "sextant/eval/report/estimator_comparisons.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/base/parallel_for.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr double alpha = 0.05;
constexpr double identical_below = 1e-9;  // m or deg: rounding of equal optima

using Estimated = std::map<SeedFrame, const Record*>;

/// What every estimator made of one body at one level.
struct Level {
  const NoiseSweep* sweep = nullptr;
  std::map<std::string, Estimated> by_estimator;
};

/// Of the cases whose records both have that error; nothing where there is none.
std::optional<ErrorComparison> compare(const std::vector<SeedFrame>& cases, const Estimated& first,
                                       const Estimated& second, const Clusters& clusters,
                                       const std::string& key, const BootstrapOptions& options) {
  std::vector<double> of_first, differences;
  std::vector<uint64_t> labels;
  for (const SeedFrame& at : cases) {
    const Record& record = *first.at(at);
    const auto a = find_number(record.errors, key), b = find_number(second.at(at)->errors, key);
    if (!a || !b) continue;
    of_first.push_back(*a);
    differences.push_back(*b - *a);
    labels.push_back(clusters.of(record));
  }
  if (differences.empty()) return std::nullopt;
  ErrorComparison out{compare_pairs(differences, labels, options), mean(of_first)};
  out.identical = std::ranges::all_of(differences, [](double d) { return std::abs(d) <= identical_below; });
  if (out.identical) out.p = 1;
  if (out.n_clusters < 2) out.p.reset();
  return out;
}

/// Nothing where no pair was estimated by both.
std::optional<ComparisonRow> compare(const Estimated& first, const Estimated& second,
                                     const BootstrapOptions& options) {
  const std::vector<SeedFrame> cases = common_keys<Estimated>({&first, &second});
  if (cases.empty()) return std::nullopt;
  RecordRefs of_first;
  for (const SeedFrame& at : cases) of_first.push_back(first.at(at));
  const Record& any = *of_first.front();
  const auto n = static_cast<int>(cases.size());
  ComparisonRow row{.dataset = any.dataset,
                    .sequence = any.sequence,
                    .body = any.body,
                    .noise = any.noise,
                    .level = any.level,
                    .n_pairs = n,
                    .n_only_first = static_cast<int>(first.size()) - n,
                    .n_only_second = static_cast<int>(second.size()) - n};
  for (const MetricDefinition* error : metrics_for(compared)) {
    if (auto c = compare(cases, first, second, Clusters(of_first), error->name, options))
      row.errors.emplace(error->name, std::move(*c));
  }
  return row;
}

std::vector<std::string> estimators_in_order(const std::vector<NoiseSweep>& sweeps) {
  std::vector<std::string> names;
  for (const NoiseSweep& sweep : sweeps) {
    for (const Record& record : sweep.records) {
      if (std::ranges::find(names, record.estimator) == names.end()) names.push_back(record.estimator);
    }
  }
  return names;
}

std::vector<Level> levels_of(const std::vector<NoiseSweep>& sweeps) {
  using Key = std::tuple<size_t, std::string, std::string, int, double, std::string>;
  std::map<Key, Level> levels;
  for (size_t s = 0; s < sweeps.size(); ++s) {
    for (const Record& r : sweeps[s].records) {
      if (r.status != Status::ok || !has_truth(r) || !has_compared_error(r)) continue;
      Level& level = levels[{s, r.dataset, r.sequence, body_order(r), r.level, r.noise}];
      level.sweep = &sweeps[s];
      level.by_estimator[r.estimator][{r.seed, r.frame}] = &r;
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

std::vector<Column> columns_of(const MetricDefinition& error) {
  const std::string stem = error.stem();
  const int decimals = error.digits + 1;
  std::vector<Column> columns = {
      {error.key("difference"), fmt::format("\u0394 {}", error.heading()), Align::right, decimals}};
  std::ranges::move(range_columns(error.key("low"), error.key("high"), decimals),
                    std::back_inserter(columns));
  const std::vector<Column> more = {
      Column::number(stem + "_difference_percent", "[%]", 1), Column::p_value(stem + "_p").only_in_files(),
      Column::p_value(stem + "_p_corrected"), Column::number(error.key("detectable"), "detectable", decimals),
      Column::text(stem + "_verdict", "verdict")};
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

void add_cells(const MetricDefinition& error, const ComparisonRow& row, std::vector<Cell>& cells) {
  const ErrorComparison* c = find_in(row.errors, error.name);
  if (c == nullptr) {
    cells.resize(cells.size() + columns_of(error).size());
    return;
  }
  add_estimate(IntervalEstimate{c->difference, c->interval}, cells);
  for (const std::optional<double>& number : {percent(*c), c->p, c->p_corrected, c->detectable})
    cells.push_back(number);
  cells.emplace_back(verdict(*c, row));
}

}  // namespace

std::vector<ComparisonRow> compare_estimators(const std::vector<NoiseSweep>& sweeps, int jobs,
                                              const BootstrapOptions& options) {
  const std::vector<std::string> names = estimators_in_order(sweeps);
  const std::vector<Level> levels = levels_of(sweeps);
  std::vector<std::vector<ComparisonRow>> of_level(levels.size());
  parallel_for(static_cast<int>(levels.size()), jobs, [&](int i) {
    const Level& level = levels[static_cast<size_t>(i)];
    for (size_t a = 0; a < names.size(); ++a) {
      for (size_t b = a + 1; b < names.size(); ++b) {
        const auto first = level.by_estimator.find(names[a]);
        const auto second = level.by_estimator.find(names[b]);
        if (first == level.by_estimator.end() || second == level.by_estimator.end()) continue;
        std::optional<ComparisonRow> row = compare(first->second, second->second, options);
        if (!row) continue;
        row->parameter = level.sweep->parameter;
        row->first = names[a];
        row->second = names[b];
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
  return rows;
}

std::string verdict(const ErrorComparison& comparison, const ComparisonRow& row) {
  if (comparison.identical) return "identical";
  const std::optional<Interval>& interval = comparison.interval;
  if (!comparison.p_corrected || !interval) return "too few clusters";
  if (*comparison.p_corrected > alpha || (interval->low <= 0 && interval->high >= 0)) {
    return "no difference seen";
  }
  return (comparison.difference < 0 ? row.second : row.first) + " lower";
}

Table comparison_table(const std::vector<ComparisonRow>& rows) {
  Table table{
      "Estimators compared pair by pair",
      "Difference of the mean errors, second - first, over the pairs that both have estimated. Clusters "
      "of the intervals: seeds; with one seed frames. p: Wilcoxon's signed ranks on the clusters' means, "
      "corrected by Holm over the whole table. detectable: found at 5 % with probability 80 %.",
      folded_columns({"parameter", "dataset", "sequence", "first", "second"})};
  table.add_columns({Column::text("body"), Column::number("level", 3), Column::count("n_pairs", "pairs"),
                     Column::count("n_only_first", "only first").folded(),
                     Column::count("n_only_second", "only second").folded()});
  const std::vector<const MetricDefinition*> errors = metrics_for(compared);
  for (const MetricDefinition* error : errors) table.add_columns(columns_of(*error));
  table.columns.push_back(Column::text("noise").only_in_files());
  for (const ComparisonRow& row : rows) {
    std::vector<Cell> cells = {row.parameter, row.dataset, row.sequence, row.first,        row.second,
                               row.body,      row.level,   row.n_pairs,  row.n_only_first, row.n_only_second};
    for (const MetricDefinition* error : errors) add_cells(*error, row, cells);
    cells.emplace_back(row.noise);
    table.add_row(std::move(cells));
  }
  return table;
}

}  // namespace sextant
