#include "sextant/eval/report/trends.h"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "sextant/base/machine.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {
namespace {

/// One body's errors under one estimator, one entry for each of compared_errors().
using Levels = std::map<double, ClusterSums>;

void add_sums(const ClusterSums& more, ClusterSums& sums) {
  std::map<uint64_t, Moments> by_label;
  for (const ClusterSums* part : {&std::as_const(sums), &more}) {
    for (const auto& [label, of] : *part) by_label[label].add(of);
  }
  sums.clear();
  for (const auto& [label, of] : by_label) sums.push_back({label, of});
}

Levels levels_of(std::span<const NoiseLevelRef> curve, size_t error, ClusterBy by) {
  Levels levels;
  for (const NoiseLevelRef& level : curve) {
    if (!level->has(error)) continue;
    ClusterSums& sums = levels[level->key().level];
    if (sums.empty()) {
      sums = level->sums(error, by);
    } else {
      add_sums(level->sums(error, by), sums);
    }
  }
  return levels;
}

using Labels = std::set<uint64_t>;

/// The clusters that have every level.
Labels complete_clusters(const std::map<double, Labels>& by_level) {
  Labels kept;
  for (bool is_first = true; const auto& [level, labels] : by_level) {
    if (std::exchange(is_first, false)) {
      kept = labels;
    } else {
      std::erase_if(kept, [&labels = labels](uint64_t label) { return !labels.contains(label); });
    }
  }
  return kept;
}

void keep(const Labels& clusters, Levels& levels) {
  for (auto& [level, sums] : levels)
    std::erase_if(sums, [&](const ClusterSum& sum) { return !clusters.contains(sum.label); });
  std::erase_if(levels, [](const auto& item) { return item.second.empty(); });
}

std::map<double, Labels> labels_of(const std::vector<Levels>& of_errors) {
  std::map<double, Labels> by_level;
  for (const Levels& levels : of_errors) {
    for (const auto& [level, sums] : levels) {
      for (const ClusterSum& sum : sums) by_level[level].insert(sum.label);
    }
  }
  return by_level;
}

/// Of clusters that all have every level.
ErrorTrend trend_of(const Levels& levels, const BootstrapOptions& options) {
  ErrorTrend trend;
  std::vector<LevelSums> sums;
  std::vector<double> means;
  std::vector<std::vector<double>> blocks(levels.begin()->second.size());
  for (const auto& [level, clusters] : levels) {
    means.push_back(total(clusters).mean());
    for (size_t c = 0; c < clusters.size(); ++c) blocks[c].push_back(clusters[c].of.mean());
    sums.push_back({level, clusters});
  }
  trend.mean_lowest = means.front();
  trend.mean_highest = means.back();
  trend.n_steps = static_cast<int>(means.size()) - 1;
  for (size_t l = 1; l < means.size(); ++l) trend.n_rises += means[l] > means[l - 1] ? 1 : 0;
  trend.slope = noise_slope(sums, options);
  if (blocks.size() >= 2) trend.p = page_trend_test(blocks).p;
  return trend;
}

TrendRow row_of(std::span<const NoiseLevelRef> curve, const BootstrapOptions& options) {
  const ClusterBy by = clusters_of(curve);
  std::vector<Levels> of_errors;
  for (size_t e = 0; e < compared_errors().size(); ++e) of_errors.push_back(levels_of(curve, e, by));
  const std::map<double, Labels> by_level = labels_of(of_errors);
  const Labels kept = complete_clusters(by_level);
  TrendRow row;
  if (kept.empty()) return row;
  const NoiseLevelKey& key = curve.front()->key();
  row = {{}, key.dataset, key.sequence, key.body, key.estimator};
  row.n_levels = static_cast<int>(by_level.size());
  row.n_clusters = static_cast<int>(kept.size());
  row.lowest = by_level.begin()->first;
  row.highest = by_level.rbegin()->first;
  if (row.n_levels < 2) return row;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    Levels& levels = of_errors[e];
    keep(kept, levels);
    keep(complete_clusters(labels_of({levels})), levels);
    if (levels.size() >= 2) row.errors[compared_errors()[e]->name] = trend_of(levels, options);
  }
  return row;
}

std::vector<Column> columns_of(const MetricDefinition& error) {
  const std::string stem = error.stem();
  const int decimals = error.digits + 1;
  std::vector<Column> columns = {
      {error.key("lowest"), error.symbol + " at lowest", Align::right, decimals, false, true},
      {error.key("highest"), error.symbol + " at highest", Align::right, decimals, false, true},
      {error.key("slope"), fmt::format("{} slope [{}]", error.symbol, error.unit), Align::right, decimals}};
  std::ranges::move(range_columns(error.key("slope_low"), error.key("slope_high"), decimals),
                    std::back_inserter(columns));
  const std::vector<Column> more = {{stem + "_relative_slope", "relative", Align::right, 2},
                                    {stem + "_relative_slope_low", "low", Align::right, 2, false, true},
                                    {stem + "_relative_slope_high", "high", Align::right, 2, false, true},
                                    {stem + "_rises", "rises", Align::right},
                                    {stem + "_p", "p", Align::right, 4, false, true, true},
                                    {stem + "_p_corrected", "p", Align::right, 4, false, false, true}};
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

void add_cells(const MetricDefinition& error, const TrendRow& row, std::vector<Cell>& cells) {
  const ErrorTrend* trend = find_in(row.errors, error.name);
  if (trend == nullptr) {
    cells.resize(cells.size() + columns_of(error).size());
    return;
  }
  cells.emplace_back(trend->mean_lowest);
  cells.emplace_back(trend->mean_highest);
  add_estimate(IntervalEstimate{trend->slope.slope, trend->slope.interval}, cells);
  cells.push_back(cell(trend->slope.relative_slope));
  add_interval(trend->slope.relative_interval, cells);
  cells.emplace_back(fmt::format("{}/{}", trend->n_rises, trend->n_steps));
  cells.push_back(cell(trend->p));
  cells.push_back(cell(trend->p_corrected));
}

}  // namespace

std::vector<TrendRow> noise_trends(const std::vector<NoiseSweep>& sweeps, int jobs,
                                   const BootstrapOptions& options) {
  std::vector<std::pair<const NoiseSweep*, std::span<const NoiseLevelRef>>> curves;
  for (const NoiseSweep& sweep : sweeps) {
    for (const auto& curve : curves_of(sweep.levels)) curves.emplace_back(&sweep, curve);
  }
  std::vector<TrendRow> rows(curves.size());
  parallel_for(static_cast<int>(curves.size()), jobs, [&](int i) {
    const auto& [sweep, curve] = curves[static_cast<size_t>(i)];
    rows[static_cast<size_t>(i)] = row_of(curve, options);
    rows[static_cast<size_t>(i)].parameter = sweep->parameter;
  });
  std::erase_if(rows, [](const TrendRow& row) { return row.n_levels < 2; });
  std::vector<ErrorTrend*> family;
  for (TrendRow& row : rows) {
    for (auto& [name, trend] : row.errors) family.push_back(&trend);
  }
  correct_by_holm(family);
  return rows;
}

Table trend_table(const std::vector<TrendRow>& rows) {
  Table table{
      "Growth of the errors with the noise",
      "Line through all estimated pairs; slope per unit of the level with its 95 % interval (bootstrap, "
      "clusters: seeds; with one seed frames). relative: slope / error at the lowest level. rises: steps at "
      "which the mean rises. p: Page's test of growth over the clusters' means, corrected by Holm over the "
      "table.",
      folded_columns({"parameter", "dataset", "sequence"})};
  table.columns.push_back({"body", "body", Align::left});
  table.add_columns(folded_columns({"estimator"}));
  table.add_columns({{"lowest", "from", Align::right, 2, true},
                     {"highest", "to", Align::right, 2, true},
                     {"n_clusters", "clusters", Align::right, 0, true}});
  const std::vector<const MetricDefinition*> errors = metrics_for(compared);
  for (const MetricDefinition* error : errors) table.add_columns(columns_of(*error));
  for (const TrendRow& row : rows) {
    std::vector<Cell> cells = {row.parameter, row.dataset, row.sequence, row.body,
                               row.estimator, row.lowest,  row.highest,  static_cast<double>(row.n_clusters)};
    for (const MetricDefinition* error : errors) add_cells(*error, row, cells);
    table.add_row(std::move(cells));
  }
  return table;
}

}  // namespace sextant
