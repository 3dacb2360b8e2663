#include "sextant/eval/report/comparisons.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "sextant/base/parallel_for.h"
#include "sextant/eval/report/multiplicity.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/cluster_means.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

constexpr double alpha = 0.05;
constexpr double identical_below = 1e-9;  // m or deg: rounding of equal optima

using PairKey = std::pair<uint64_t, int>;  // seed, frame
using Estimated = std::map<PairKey, const Record*>;

/// What every estimator made of one body at one level.
struct Level {
  const NoiseSweep* sweep = nullptr;
  std::map<std::string, Estimated> by_estimator;
};

ErrorComparison compare(const std::vector<const Record*>& first, const std::vector<const Record*>& second,
                        const std::string& key, const BootstrapOptions& options) {
  const Clusters clusters(first);
  const ErrorSample a = error_sample(first, key, clusters);
  const ErrorSample b = error_sample(second, key, clusters);
  ErrorComparison out;
  out.mean_first = mean(a.values);
  out.difference = paired_difference(b.values, a.values, a.clusters, options);
  std::vector<double> differences;
  for (size_t i = 0; i < a.values.size(); ++i) differences.push_back(b.values[i] - a.values[i]);
  out.identical = std::ranges::all_of(differences, [](double d) { return std::abs(d) <= identical_below; });
  const std::vector<double> by_cluster = cluster_means(differences, a.clusters);
  if (by_cluster.size() < 2) return out;
  out.p = out.identical ? 1.0 : wilcoxon_test(by_cluster).p;
  out.detectable = minimum_detectable_effect(std_dev(by_cluster), static_cast<int>(by_cluster.size()));
  return out;
}

/// Nothing where no pair was estimated by both.
std::optional<ComparisonRow> compare(const Estimated& first, const Estimated& second,
                                     const BootstrapOptions& options) {
  std::vector<const Record*> a, b;
  for (const auto& [key, record] : first) {
    const auto other = second.find(key);
    if (other == second.end()) continue;
    a.push_back(record);
    b.push_back(other->second);
  }
  if (a.empty()) return std::nullopt;
  ComparisonRow row;
  row.dataset = a.front()->dataset;
  row.sequence = a.front()->sequence;
  row.body = a.front()->body;
  row.noise = a.front()->noise;
  row.level = a.front()->level;
  row.n_pairs = static_cast<int>(a.size());
  row.n_only_first = static_cast<int>(first.size() - a.size());
  row.n_only_second = static_cast<int>(second.size() - a.size());
  row.Et_m = compare(a, b, "Et_m", options);
  row.ER_deg = compare(a, b, "ER_deg", options);
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
      if (r.status != Status::ok || !has_truth(r) || !r.errors.contains("Et_m")) continue;
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
  return 100 * comparison.difference.mean / comparison.mean_first;
}

void add_cells(const ErrorComparison& comparison, const ComparisonRow& row, std::vector<Cell>& cells) {
  cells.emplace_back(comparison.difference.mean);
  add_interval(comparison.difference.interval, cells);
  cells.push_back(cell(percent(comparison)));
  cells.push_back(cell(comparison.p));
  cells.push_back(cell(comparison.p_corrected));
  cells.push_back(cell(comparison.detectable));
  cells.emplace_back(verdict(comparison, row));
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
  correct_p_values(rows);
  return rows;
}

std::string verdict(const ErrorComparison& comparison, const ComparisonRow& row) {
  if (comparison.identical) return "identical";
  const std::optional<Interval>& interval = comparison.difference.interval;
  if (!comparison.p_corrected || !interval) return "too few clusters";
  if (*comparison.p_corrected > alpha || (interval->low <= 0 && interval->high >= 0)) {
    return "no difference seen";
  }
  return (comparison.difference.mean < 0 ? row.second : row.first) + " lower";
}

Table comparison_table(const std::vector<ComparisonRow>& rows) {
  Table table;
  table.title = "Estimators compared pair by pair";
  table.caption =
      "Difference of the mean errors, second - first, over the pairs that both have estimated. Clusters "
      "of the intervals: seeds; with one seed frames. p: Wilcoxon's signed ranks on the clusters' means, "
      "corrected by Holm over the whole table. detectable: found at 5 % with probability 80 %.";
  table.columns = {{"parameter", "parameter", Align::left, 0, true},
                   {"dataset", "dataset", Align::left, 0, true},
                   {"sequence", "sequence", Align::left, 0, true},
                   {"first", "first", Align::left, 0, true},
                   {"second", "second", Align::left, 0, true},
                   {"body", "body", Align::left},
                   {"level", "level", Align::right, 3},
                   {"n_pairs", "pairs", Align::right, 0},
                   {"n_only_first", "only first", Align::right, 0, true},
                   {"n_only_second", "only second", Align::right, 0, true}};
  const auto add_columns = [&](const std::string& symbol, const std::string& key, const std::string& unit) {
    table.columns.insert(
        table.columns.end(),
        {{key + "_difference_" + unit, fmt::format("\u0394 {} [{}]", symbol, unit), Align::right, 5},
         {key + "_low_" + unit, "low", Align::right, 5, false, false, false, "95 % interval"},
         {key + "_high_" + unit, "high", Align::right, 5},
         {key + "_difference_percent", "[%]", Align::right, 1},
         {key + "_p", "p", Align::right, 4, false, true, true},
         {key + "_p_corrected", "p", Align::right, 4, false, false, true},
         {key + "_detectable_" + unit, "detectable", Align::right, 5},
         {key + "_verdict", "verdict", Align::left}});
  };
  add_columns("E_t", "Et", "m");
  add_columns("E_R", "ER", "deg");
  table.columns.push_back({"noise", "noise", Align::left, 0, false, true});
  for (const ComparisonRow& row : rows) {
    std::vector<Cell> cells = {row.parameter,
                               row.dataset,
                               row.sequence,
                               row.first,
                               row.second,
                               row.body,
                               row.level,
                               static_cast<double>(row.n_pairs),
                               static_cast<double>(row.n_only_first),
                               static_cast<double>(row.n_only_second)};
    add_cells(row.Et_m, row, cells);
    add_cells(row.ER_deg, row, cells);
    cells.emplace_back(row.noise);
    table.add_row(std::move(cells));
  }
  return table;
}

}  // namespace sextant
