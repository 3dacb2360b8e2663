#include "sextant/eval/report/trends.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "sextant/base/machine.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/paired_comparison.h"
#include "sextant/stats/summary.h"

namespace sextant {

namespace {

/// Removes the clusters that lack a level which another one has; returns the levels.
std::set<double> keep_complete(ClusterLevels& clusters) {
  std::set<double> levels;
  for (const auto& [label, of_levels] : clusters) {
    for (const auto& [level, of] : of_levels) levels.insert(level);
  }
  std::erase_if(clusters, [&](const auto& cluster) { return cluster.second.size() < levels.size(); });
  return levels;
}

/// Computes the trend of one error; every cluster must have every level.
ErrorTrend trend_of(const ClusterLevels& clusters, const BootstrapOptions& options) {
  std::map<double, ClusterSums> by_level;
  std::vector<std::vector<double>> blocks;
  for (const auto& [label, of_levels] : clusters) {
    std::vector<double>& block = blocks.emplace_back();
    for (const auto& [level, of] : of_levels) {
      by_level[level].push_back({label, of});
      block.push_back(of.mean());
    }
  }
  std::vector<LevelSums> sums;
  std::vector<double> means;
  for (const auto& [level, of_level] : by_level) {
    sums.push_back({level, of_level});
    means.push_back(total(of_level).mean());
  }
  ErrorTrend trend{.mean_lowest = means.front(), .mean_highest = means.back()};
  trend.n_steps = static_cast<int>(means.size()) - 1;
  for (size_t l = 1; l < means.size(); ++l) trend.n_rises += means[l] > means[l - 1] ? 1 : 0;
  trend.slope = noise_slope(sums, options);
  if (blocks.size() >= 2) trend.p = page_trend_test(blocks);
  return trend;
}

TrendRow row_of(const std::string& parameter, std::span<const NoiseLevelRef> curve,
                const BootstrapOptions& options) {
  const ClusterBy by = clusters_of(curve);
  std::vector<ClusterLevels> of_errors;
  ClusterLevels together;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    for (const auto& [label, of_levels] : of_errors.emplace_back(sums_by_cluster(curve, e, by)))
      together[label].insert(of_levels.begin(), of_levels.end());
  }
  const std::set<double> levels = keep_complete(together);
  TrendRow row{CurveKey::of(parameter, curve.front()->key())};
  if (together.empty()) return row;
  row.n_levels = static_cast<int>(levels.size());
  row.n_clusters = static_cast<int>(together.size());
  row.lowest = *levels.begin();
  row.highest = *levels.rbegin();
  if (row.n_levels < 2) return row;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    ClusterLevels& clusters = of_errors[e];
    std::erase_if(clusters, [&](const auto& cluster) { return !together.contains(cluster.first); });
    if (keep_complete(clusters).size() >= 2 && !clusters.empty())
      row.errors[compared_errors()[e]->name] = trend_of(clusters, options);
  }
  return row;
}

Fields<ErrorTrend> trend_fields(const MetricDefinition& error) {
  const std::string stem = error.stem();
  const int decimals = error.digits + 1;
  Fields<ErrorTrend> fields = {
      {Column::number(error.key("lowest"), error.symbol + " at lowest", decimals).only_in_files(),
       &ErrorTrend::mean_lowest},
      {Column::number(error.key("highest"), error.symbol + " at highest", decimals).only_in_files(),
       &ErrorTrend::mean_highest}};
  const auto slope = [](const ErrorTrend& trend) { return &trend.slope; };
  Fields<NoiseSlope> of_slope = {
      {Column::number(error.key("slope"), fmt::format("{} slope [{}]", error.symbol, error.unit), decimals),
       &NoiseSlope::slope}};
  of_slope.add_range(range_columns(error.key("slope_low"), error.key("slope_high"), decimals),
                     &NoiseSlope::interval);
  of_slope.add(Column::number(stem + "_relative_slope", "relative", 2), &NoiseSlope::relative_slope);
  of_slope.add_range({Column::number(stem + "_relative_slope_low", "low", 2).only_in_files(),
                      Column::number(stem + "_relative_slope_high", "high", 2).only_in_files()},
                     &NoiseSlope::relative_interval);
  fields.add(of_slope, slope);
  return fields.add({{Column::number(stem + "_rises", "rises", 0),
                      [](const ErrorTrend& t) { return fmt::format("{}/{}", t.n_rises, t.n_steps); }},
                     {Column::p_value(stem + "_p").only_in_files(), &ErrorTrend::p},
                     {Column::p_value(stem + "_p_corrected"), &ErrorTrend::p_corrected}});
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
    rows[static_cast<size_t>(i)] = row_of(sweep->parameter, curve, options);
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
  using Row = TrendRow;
  Fields<Row> fields;
  fields.add(CurveKey::fields(), [](const Row& row) { return &row; });
  fields.add({{Column::number("lowest", "from", 2).folded(), &Row::lowest},
              {Column::number("highest", "to", 2).folded(), &Row::highest},
              {Column::count("n_clusters", "clusters").folded(), &Row::n_clusters}});
  for (const MetricDefinition* error : compared_errors()) {
    fields.add(trend_fields(*error),
               [name = error->name](const Row& row) { return find_in(row.errors, name); });
  }
  return with_distinct(
      table_of(
          "Growth of the errors with the noise",
          "Line through the estimated pairs of the seeds (clusters; with one seed: frames) that have "
          "estimates at every level; slope per unit of the level with its 95 % interval (bootstrap over "
          "them). relative: slope / error at the lowest level. rises: "
          "steps at which the mean rises. p: Page's test of growth over the clusters' means, corrected by "
          "Holm over the table.",
          fields, rows),
      {"lowest", "highest"});
}

namespace {

std::optional<FallingError::Mean> common_mean(const NoiseLevel& low, const NoiseLevel& high, size_t error) {
  const auto common = low.common(high, error);
  if (!common || common->empty()) return std::nullopt;
  Moments at_low, at_high;
  for (const NoiseLevel::Common& pair : *common) {
    at_low.add(pair.first);
    at_high.add(pair.second);
  }
  return FallingError::Mean{static_cast<size_t>(at_low.n), at_low.mean(), at_high.mean()};
}

double mean_of(const NoiseLevel& level, size_t error) {
  return summarize_sample(level.sample(error, level.clusters())).mean.value;
}

}  // namespace

std::string FallingError::reason() const {
  if (!common_Et_m)
    return "not known: no pair is estimated at both levels, or the sweep kept summaries of other pairs";
  if (common_Et_m->highest >= least_fall * common_Et_m->lowest)
    return "coverage: it does not fall on the pairs that both levels estimated";
  return "selection of points, or chance: it falls on the pairs that both levels estimated";
}

std::vector<FallingError> falling_errors(const std::vector<NoiseSweep>& sweeps) {
  const size_t error = compared_error("Et_m");
  std::vector<FallingError> rows;
  for (const NoiseSweep& sweep : sweeps) {
    for (const auto& curve : curves_of(sweep.levels)) {
      const NoiseLevel &low = *curve.front(), &high = *curve.back();
      if (low.key().level == high.key().level || !low.has(error) || !high.has(error)) continue;
      if (!increases_noise(sweep.parameter)) continue;
      const FallingError::Mean all = {high.n_estimated(), mean_of(low, error), mean_of(high, error)};
      if (!(all.highest < least_fall * all.lowest)) continue;
      rows.push_back({CurveKey::of(sweep.parameter, low.key()), low.key().level, high.key().level, all,
                      low.n_estimated(), common_mean(low, high, error)});
    }
  }
  return rows;
}

Table falling_error_table(const std::vector<FallingError>& rows) {
  const auto common = [](double FallingError::Mean::*value) {
    return [value](const FallingError& row) {
      return row.common_Et_m ? Cell((*row.common_Et_m).*value) : Cell();
    };
  };
  return with_distinct(
      table_of<FallingError>(
          "Errors that fall as noise rises",
          "Mean E_t at the lowest and the highest level: over all estimated pairs, and over the pairs that "
          "both levels estimated.",
          {{Column::text("parameter"), &FallingError::parameter},
           {Column::text("dataset"), &FallingError::dataset},
           {Column::text("sequence"), &FallingError::sequence},
           {Column::text("body"), &FallingError::body},
           {Column::text("estimator"), &FallingError::estimator},
           {Column::number("lowest", "from level", 3), &FallingError::lowest},
           {Column::number("highest", "to", 3), &FallingError::highest},
           {Column::count("n_lowest", "pairs"), &FallingError::n_lowest},
           {Column::count("n_highest", "pairs"), [](const FallingError& row) { return row.Et_m.n; }},
           {Column::number("Et_lowest_m", "E_t [m]", 4),
            [](const FallingError& row) { return row.Et_m.lowest; }},
           {Column::number("Et_highest_m", "E_t [m]", 4),
            [](const FallingError& row) { return row.Et_m.highest; }},
           {Column::count("n_common", "of both"),
            [](const FallingError& row) { return row.common_Et_m ? Cell(row.common_Et_m->n) : Cell(); }},
           {Column::number("common_Et_lowest_m", "E_t [m]", 4), common(&FallingError::Mean::lowest)},
           {Column::number("common_Et_highest_m", "E_t [m]", 4), common(&FallingError::Mean::highest)},
           {Column::text("reason"), &FallingError::reason}},
          rows),
      {"lowest", "highest"});
}

}  // namespace sextant
