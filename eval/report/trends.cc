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

/// Sums of one body's errors by level, with one entry for each of compared_errors().
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

/// Returns the clusters that have every level.
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

/// Computes the trend of one error; every cluster must have every level.
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

TrendRow row_of(const std::string& parameter, std::span<const NoiseLevelRef> curve,
                const BootstrapOptions& options) {
  const ClusterBy by = clusters_of(curve);
  std::vector<Levels> of_errors;
  for (size_t e = 0; e < compared_errors().size(); ++e) of_errors.push_back(levels_of(curve, e, by));
  const std::map<double, Labels> by_level = labels_of(of_errors);
  const Labels kept = complete_clusters(by_level);
  TrendRow row{CurveKey::of(parameter, curve.front()->key())};
  if (kept.empty()) return row;
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
  FallingError::Mean mean;
  const auto add = [&](size_t n, double sum_low, double sum_high) {
    mean.n += n;
    mean.lowest += sum_low;
    mean.highest += sum_high;
  };
  if (low.is_summed()) {
    const auto by_seed = low.paired_sums(high, error);
    if (!by_seed) return std::nullopt;
    for (const auto& sums : *by_seed) add(static_cast<size_t>(sums.first.n), sums.first.x, sums.second.x);
  } else {
    for (const auto& [a, b] : low.pairs(high)) {
      const double at_low = low.error(error, a), at_high = high.error(error, b);
      if (std::isfinite(at_low) && std::isfinite(at_high)) add(1, at_low, at_high);
    }
  }
  if (mean.n == 0) return std::nullopt;
  mean.lowest /= static_cast<double>(mean.n);
  mean.highest /= static_cast<double>(mean.n);
  return mean;
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
