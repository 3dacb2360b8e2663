#include "sextant/eval/report/trends.h"

#include <map>
#include <set>
#include <tuple>

#include "sextant/base/parallel_for.h"
#include "sextant/eval/report/multiplicity.h"
#include "sextant/eval/report/record_reading.h"

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
  std::vector<const Record*> records;
};

std::vector<const Record*> with_all_levels(const std::vector<const Record*>& records,
                                           const Clusters& clusters) {
  std::set<double> levels;
  std::map<uint64_t, std::set<double>> of_cluster;
  for (const Record* record : records) {
    levels.insert(record->level);
    of_cluster[clusters.of(*record)].insert(record->level);
  }
  std::vector<const Record*> kept;
  for (const Record* record : records) {
    if (of_cluster[clusters.of(*record)].size() == levels.size()) kept.push_back(record);
  }
  return kept;
}

ErrorTrend trend_of(const std::vector<const Record*>& records, const Clusters& clusters,
                    const std::string& key, const BootstrapOptions& options) {
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
  const std::vector<const Record*> records = with_all_levels(body.records, clusters);
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
  row.Et_m = trend_of(records, clusters, "Et_m", options);
  row.ER_deg = trend_of(records, clusters, "ER_deg", options);
  return row;
}

void add_cells(const ErrorTrend& trend, int n_levels, std::vector<Cell>& cells) {
  cells.emplace_back(trend.mean_lowest);
  cells.emplace_back(trend.mean_highest);
  cells.emplace_back(trend.slope.slope);
  add_interval(trend.slope.interval, cells);
  cells.push_back(cell(trend.slope.relative_slope));
  add_interval(trend.slope.relative_interval, cells);
  cells.emplace_back(fmt::format("{}/{}", trend.n_rises, n_levels - 1));
  cells.push_back(cell(trend.p));
  cells.push_back(cell(trend.p_corrected));
}

}  // namespace

std::vector<TrendRow> noise_trends(const std::vector<NoiseSweep>& sweeps, int jobs,
                                   const BootstrapOptions& options) {
  using Key = std::tuple<size_t, std::string, std::string, int, std::string>;
  std::map<Key, Body> by_key;
  for (size_t s = 0; s < sweeps.size(); ++s) {
    for (const Record& r : sweeps[s].records) {
      if (r.status != Status::ok || !has_truth(r)) continue;
      if (!r.errors.contains("Et_m") || !r.errors.contains("ER_deg")) continue;
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
  correct_p_values(rows);
  return rows;
}

Table trend_table(const std::vector<TrendRow>& rows) {
  Table table;
  table.title = "Growth of the errors with the noise";
  table.caption =
      "Line through all estimated pairs; slope per unit of the level with its 95 % interval (bootstrap, "
      "clusters: seeds; with one seed frames). relative: slope / error at the lowest level. rises: steps at "
      "which the mean rises. p: Page's test of growth over the clusters' means, corrected by Holm over the "
      "table.";
  table.columns = {
      {"parameter", "parameter", Align::left, 0, true}, {"dataset", "dataset", Align::left, 0, true},
      {"sequence", "sequence", Align::left, 0, true},   {"body", "body", Align::left},
      {"estimator", "estimator", Align::left, 0, true}, {"lowest", "from", Align::right, 2, true},
      {"highest", "to", Align::right, 2, true},         {"n_clusters", "clusters", Align::right, 0, true}};
  const auto add_columns = [&](const std::string& symbol, const std::string& key, const std::string& unit) {
    table.columns.insert(
        table.columns.end(),
        {{key + "_lowest_" + unit, symbol + " at lowest", Align::right, 5, false, true},
         {key + "_highest_" + unit, symbol + " at highest", Align::right, 5, false, true},
         {key + "_slope_" + unit, fmt::format("{} slope [{}]", symbol, unit), Align::right, 5},
         {key + "_slope_low_" + unit, "low", Align::right, 5, false, false, false, "95 % interval"},
         {key + "_slope_high_" + unit, "high", Align::right, 5},
         {key + "_relative_slope", "relative", Align::right, 2},
         {key + "_relative_slope_low", "low", Align::right, 2, false, true},
         {key + "_relative_slope_high", "high", Align::right, 2, false, true},
         {key + "_rises", "rises", Align::right},
         {key + "_p", "p", Align::right, 4, false, true, true},
         {key + "_p_corrected", "p", Align::right, 4, false, false, true}});
  };
  add_columns("E_t", "Et", "m");
  add_columns("E_R", "ER", "deg");
  for (const TrendRow& row : rows) {
    std::vector<Cell> cells = {row.parameter, row.dataset, row.sequence, row.body,
                               row.estimator, row.lowest,  row.highest,  static_cast<double>(row.n_clusters)};
    add_cells(row.Et_m, row.n_levels, cells);
    add_cells(row.ER_deg, row.n_levels, cells);
    table.add_row(std::move(cells));
  }
  return table;
}

}  // namespace sextant
