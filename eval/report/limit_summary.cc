#include "sextant/eval/report/limit_summary.h"

#include <algorithm>

#include "sextant/metrics/crlb.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

/// Of the records that have both; none where there are none, or all errors are 0.
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

std::optional<Efficiency> efficiency(const RecordRefs& records, const std::string& key,
                                     const BootstrapOptions& options) {
  Moments bounds;
  std::vector<double> errors;
  std::vector<uint64_t> seeds;
  for (const Record* record : records) {
    const auto bound = find_number(record->bound, key);
    const auto error = find_number(record->errors, key);
    if (!bound || !error) continue;
    bounds.add(*bound);
    errors.push_back(*error);
    seeds.push_back(record->seed);
  }
  return errors.empty() ? std::nullopt : efficiency(cluster_sums(errors, seeds), bounds, options);
}

std::optional<Consistency> consistency(const Moments& nees) {
  if (nees.n == 0) return std::nullopt;
  const int n = static_cast<int>(nees.n);
  return Consistency{nees.mean(), nees_interval(n, nees_dof), n};
}

}  // namespace

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

LimitSummary summarize_limit(const RecordRefs& estimated, const BootstrapOptions& options) {
  LimitSummary limit;
  for (const MetricDefinition* error : bounded_errors()) {
    if (const auto value = efficiency(estimated, error->name, options))
      limit.efficiency[error->name] = *value;
  }
  Moments nees;
  for (const double value : numbers_of(estimated, NumberMap::values, "nees")) nees.add(value);
  limit.consistency = consistency(nees);
  return limit;
}

std::vector<Column> limit_columns() {
  std::vector<Column> columns;
  for (const MetricDefinition* error : bounded_errors()) {
    const std::string key = error->stem() + "_efficiency";
    columns.push_back({.key = error->key("bound"),
                       .title = metric(NumberMap::bound, error->name).heading(),
                       .decimals = error->digits + 1});
    columns.push_back({.key = key, .title = "efficiency", .decimals = 3});
    std::ranges::move(range_columns(key + "_low", key + "_high", 3), std::back_inserter(columns));
  }
  columns.push_back({.key = "anees", .title = "ANEES", .decimals = 2});
  columns.push_back(
      {.key = "anees_expected_low", .title = "ANEES expected from", .decimals = 2, .range = "expected"});
  columns.push_back({.key = "anees_expected_high", .title = "ANEES expected to", .decimals = 2});
  for (Column& column : columns) column.fold = true;
  return columns;
}

void add_limit_cells(const LimitSummary& limit, std::vector<Cell>& cells) {
  for (const MetricDefinition* error : bounded_errors()) {
    const Efficiency* value = find_in(limit.efficiency, error->name);
    cells.push_back(value ? std::optional(value->bound) : std::nullopt);
    add_estimate(value ? std::optional(IntervalEstimate{value->efficiency, value->interval}) : std::nullopt,
                 cells);
  }
  const std::optional<Consistency>& c = limit.consistency;
  add_estimate(c ? std::optional(IntervalEstimate{c->anees, c->expected}) : std::nullopt, cells);
}

}  // namespace sextant
