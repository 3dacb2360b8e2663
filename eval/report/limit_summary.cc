#include "sextant/eval/report/limit_summary.h"

#include <algorithm>

#include "sextant/metrics/nees.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

std::optional<Efficiency> efficiency(const RecordRefs& records, const std::string& key,
                                     const BootstrapOptions& options) {
  std::vector<double> bounds, errors;
  std::vector<uint64_t> seeds;
  for (const Record* record : records) {
    const auto bound = find_number(record->bound, key);
    const auto error = find_number(record->errors, key);
    if (!bound || !error) continue;
    bounds.push_back(*bound);
    errors.push_back(*error);
    seeds.push_back(record->seed);
  }
  if (errors.empty() || rmse(errors) == 0) return std::nullopt;
  const auto rms = [](std::span<const double> sample) { return rmse(sample); };
  Efficiency out{rmse(bounds), rmse(bounds) / rmse(errors), std::nullopt};
  const std::optional<Interval> interval = bootstrap_by_cluster(errors, seeds, rms, options);
  if (interval && interval->low > 0) out.interval = {out.bound / interval->high, out.bound / interval->low};
  return out;
}

std::optional<Consistency> consistency(const RecordRefs& records) {
  const std::vector<double> values = numbers_of(records, NumberMap::values, "nees");
  if (values.empty()) return std::nullopt;
  const int n = static_cast<int>(values.size());
  return Consistency{mean(values), nees_interval(n, nees_dof), n};
}

}  // namespace

std::vector<const MetricDefinition*> bounded_errors() {
  std::vector<const MetricDefinition*> bounded = metrics_for(compared);
  std::erase_if(bounded, [](const MetricDefinition* m) { return !find_metric(NumberMap::bound, m->name); });
  return bounded;
}

LimitSummary summarize_limit(const RecordRefs& estimated, const BootstrapOptions& options) {
  LimitSummary limit;
  for (const MetricDefinition* error : bounded_errors()) {
    if (const auto value = efficiency(estimated, error->name, options))
      limit.efficiency[error->name] = *value;
  }
  limit.consistency = consistency(estimated);
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
