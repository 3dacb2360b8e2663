#include "sextant/eval/report/limit_summary.h"

#include "sextant/eval/report/record_reading.h"
#include "sextant/metrics/nees.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {
namespace {

std::optional<Efficiency> efficiency(const std::vector<const Record*>& records, const std::string& key,
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

std::optional<Consistency> consistency(const std::vector<const Record*>& records) {
  std::vector<double> values;
  for (const Record* record : records) {
    if (const auto value = find_number(record->values, "nees")) values.push_back(*value);
  }
  if (values.empty()) return std::nullopt;
  const int n = static_cast<int>(values.size());
  return Consistency{mean(values), nees_interval(n, nees_dof), n};
}

void add_cells(const std::optional<Efficiency>& value, std::vector<Cell>& cells) {
  cells.push_back(cell(value ? std::optional(value->bound) : std::nullopt));
  cells.push_back(cell(value ? std::optional(value->efficiency) : std::nullopt));
  add_interval(value ? value->interval : std::nullopt, cells);
}

}  // namespace

LimitSummary summarize_limit(const std::vector<const Record*>& estimated, const BootstrapOptions& options) {
  return {efficiency(estimated, "Et_m", options), efficiency(estimated, "ER_deg", options),
          consistency(estimated)};
}

std::vector<Column> limit_columns() {
  return {{"Et_bound_m", "E_t bound [m]", Align::right, 5, true},
          {"Et_efficiency", "efficiency", Align::right, 3, true},
          {"Et_efficiency_low", "low", Align::right, 3, true, false, false, "95 % interval"},
          {"Et_efficiency_high", "high", Align::right, 3, true},
          {"ER_bound_deg", "E_R bound [deg]", Align::right, 5, true},
          {"ER_efficiency", "efficiency", Align::right, 3, true},
          {"ER_efficiency_low", "low", Align::right, 3, true, false, false, "95 % interval"},
          {"ER_efficiency_high", "high", Align::right, 3, true},
          {"anees", "ANEES", Align::right, 2, true},
          {"anees_expected_low", "ANEES expected from", Align::right, 2, true, false, false, "expected"},
          {"anees_expected_high", "ANEES expected to", Align::right, 2, true}};
}

void add_limit_cells(const LimitSummary& limit, std::vector<Cell>& cells) {
  add_cells(limit.Et, cells);
  add_cells(limit.ER, cells);
  const std::optional<Consistency>& consistency = limit.consistency;
  cells.push_back(cell(consistency ? std::optional(consistency->anees) : std::nullopt));
  add_interval(consistency ? std::optional(consistency->expected) : std::nullopt, cells);
}

}  // namespace sextant
