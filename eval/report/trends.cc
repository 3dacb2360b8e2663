#include "sextant/eval/report/trends.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "sextant/base/parallel_for.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/paired_comparison.h"

namespace sextant {
namespace {

struct Mean {
  double sum = 0;
  int n = 0;
  void add(double value) {
    sum += value;
    ++n;
  }
  double value() const { return sum / n; }
};

/// One body's errors under one estimator.
struct Body {
  const NoiseSweep* sweep = nullptr;
  RecordRefs records;
};

RecordRefs with_all_levels(const RecordRefs& records, const Clusters& clusters) {
  std::set<double> levels;
  std::map<uint64_t, std::set<double>> of_cluster;
  for (const Record* record : records) {
    levels.insert(record->level);
    of_cluster[clusters.of(*record)].insert(record->level);
  }
  RecordRefs kept;
  for (const Record* record : records) {
    if (of_cluster[clusters.of(*record)].size() == levels.size()) kept.push_back(record);
  }
  return kept;
}

ErrorTrend trend_of(const RecordRefs& records, const Clusters& clusters, const std::string& key,
                    const BootstrapOptions& options) {
  std::vector<double> level, error;
  std::vector<uint64_t> cluster;
  std::map<double, Mean> by_level;
  std::map<uint64_t, std::map<double, Mean>> by_cluster;
  for (const Record* record : records) {
    const double value = record->errors.at(key);
    level.push_back(record->level);
    error.push_back(value);
    cluster.push_back(clusters.of(*record));
    by_level[record->level].add(value);
    by_cluster[cluster.back()][record->level].add(value);
  }
  ErrorTrend trend;
  trend.mean_lowest = by_level.begin()->second.value();
  trend.mean_highest = by_level.rbegin()->second.value();
  trend.n_steps = static_cast<int>(by_level.size()) - 1;
  for (auto it = std::next(by_level.begin()); it != by_level.end(); ++it) {
    trend.n_rises += it->second.value() > std::prev(it)->second.value() ? 1 : 0;
  }
  trend.slope = noise_slope(level, error, cluster, options);
  if (by_cluster.size() < 2) return trend;
  std::vector<std::vector<double>> blocks;
  for (const auto& [label, means] : by_cluster) {
    blocks.emplace_back();
    for (const auto& [l, mean] : means) blocks.back().push_back(mean.value());
  }
  trend.p = page_trend_test(blocks).p;
  return trend;
}

TrendRow row_of(const Body& body, const BootstrapOptions& options) {
  const Clusters clusters(body.records);
  const RecordRefs records = with_all_levels(body.records, clusters);
  TrendRow row;
  if (records.empty()) return row;
  const Record& first = *records.front();
  row = {body.sweep->parameter, first.dataset, first.sequence, first.body, first.estimator};
  std::set<double> levels;
  std::set<uint64_t> labels;
  for (const Record* record : records) {
    levels.insert(record->level);
    labels.insert(clusters.of(*record));
  }
  row.n_levels = static_cast<int>(levels.size());
  row.n_clusters = static_cast<int>(labels.size());
  row.lowest = *levels.begin();
  row.highest = *levels.rbegin();
  if (row.n_levels < 2) return row;
  for (const MetricDefinition* error : metrics_for(compared)) {
    RecordRefs with_error = records;
    std::erase_if(with_error, [&](const Record* record) { return !record->errors.contains(error->name); });
    with_error = with_all_levels(with_error, clusters);
    const bool one_level = std::ranges::all_of(
        with_error, [&](const Record* record) { return record->level == with_error.front()->level; });
    if (!one_level) row.errors[error->name] = trend_of(with_error, clusters, error->name, options);
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
  using Key = std::tuple<size_t, std::string, std::string, int, std::string>;
  std::map<Key, Body> by_key;
  for (size_t s = 0; s < sweeps.size(); ++s) {
    for (const Record& r : sweeps[s].records) {
      if (r.status != Status::ok || !has_truth(r) || !has_compared_error(r)) continue;
      Body& body = by_key[{s, r.dataset, r.sequence, body_order(r), r.estimator}];
      body.sweep = &sweeps[s];
      body.records.push_back(&r);
    }
  }
  std::vector<const Body*> bodies;
  for (const auto& [key, body] : by_key) bodies.push_back(&body);
  std::vector<TrendRow> rows(bodies.size());
  parallel_for(static_cast<int>(bodies.size()), jobs, [&](int i) {
    rows[static_cast<size_t>(i)] = row_of(*bodies[static_cast<size_t>(i)], options);
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
