#include "sextant/eval/report/noise_levels.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

std::optional<ErrorSummary> summarize(const std::vector<const Record*>& records, const std::string& key,
                                      const BootstrapOptions& options) {
  std::vector<double> values;
  std::vector<uint64_t> seeds;
  for (const Record* record : records) {
    if (const auto value = find_number(record->errors, key)) {
      values.push_back(*value);
      seeds.push_back(record->seed);
    }
  }
  if (values.empty()) return std::nullopt;
  ErrorSummary out{mean(values), median(values), rmse(values), std::nullopt};
  out.interval = bootstrap_by_cluster(
      values, seeds, [](std::span<const double> sample) { return mean(sample); }, options);
  return out;
}

NoiseLevelRow summarize_level(const std::vector<const Record*>& records, const BootstrapOptions& options) {
  const Record& first = *records.front();
  NoiseLevelRow row{first.dataset, first.sequence, first.body, first.estimator, first.noise, first.level};
  std::set<uint64_t> seeds;
  std::vector<const Record*> estimated;
  std::vector<double> epe;
  for (const Record* record : records) {
    if (!has_truth(*record)) continue;
    seeds.insert(record->seed);
    ++row.n_truth;
    if (record->status != Status::ok) continue;
    estimated.push_back(record);
    if (const auto value = find_number(record->errors, "epe_initial_px");
        value && record->flow_truth == "given") {
      epe.push_back(*value);
    }
  }
  row.n_seeds = static_cast<int>(seeds.size());
  row.n_estimated = static_cast<int>(estimated.size());
  row.Et_m = summarize(estimated, "Et_m", options);
  row.ER_deg = summarize(estimated, "ER_deg", options);
  row.limit = summarize_limit(estimated, options);
  if (!epe.empty()) row.epe_initial_px = mean(epe);
  return row;
}

Cell cell(const std::optional<double>& value) { return value ? Cell(*value) : Cell(); }

void add_summary(const std::optional<ErrorSummary>& error, std::vector<Cell>& cells) {
  const bool interval = error && error->interval;
  cells.emplace_back(error ? Cell(error->mean) : Cell());
  cells.emplace_back(interval ? Cell(error->interval->low) : Cell());
  cells.emplace_back(interval ? Cell(error->interval->high) : Cell());
  cells.emplace_back(error ? Cell(error->median) : Cell());
  cells.emplace_back(error ? Cell(error->rmse) : Cell());
}

}  // namespace

std::vector<NoiseLevelRow> noise_levels(const std::vector<Record>& records, const BootstrapOptions& options) {
  using Key = std::tuple<std::string, std::string, int, std::string, double, std::string>;
  std::map<Key, std::vector<const Record*>> levels;
  for (const Record& r : records) {
    levels[{r.dataset, r.sequence, body_order(r), r.estimator, r.level, r.noise}].push_back(&r);
  }
  std::vector<NoiseLevelRow> rows;
  for (const auto& [key, of_level] : levels) {
    NoiseLevelRow row = summarize_level(of_level, options);
    if (row.n_truth > 0) rows.push_back(std::move(row));
  }
  return rows;
}

Table noise_level_table(const std::vector<NoiseLevelRow>& rows) {
  Table table;
  table.title = "Errors by noise level";
  table.caption =
      "Over the estimated pairs of all seeds; low and high: 95 % interval of the mean, bootstrap with a "
      "seed's "
      "pairs as one cluster. Objects: motion in the camera frame. Efficiency: Cramer-Rao bound (RMS) / RMSE, "
      "1 "
      "at best but for bias and current depths; ANEES: mean normalised error squared, within its interval "
      "for "
      "an estimator that knows its own error.";
  table.columns = {{"dataset", "dataset", Align::left, 0, true},
                   {"sequence", "sequence", Align::left, 0, true},
                   {"body", "body", Align::left},
                   {"estimator", "estimator", Align::left, 0, true},
                   {"level", "level", Align::right, 3},
                   {"n_seeds", "seeds", Align::right, 0},
                   {"coverage_percent", "coverage [%]", Align::right, 1},
                   {"Et_mean_m", "E_t mean [m]", Align::right, 5},
                   {"Et_low_m", "low", Align::right, 5},
                   {"Et_high_m", "high", Align::right, 5},
                   {"Et_median_m", "median", Align::right, 5},
                   {"Et_rmse_m", "RMSE", Align::right, 5},
                   {"ER_mean_deg", "E_R mean [deg]", Align::right, 5},
                   {"ER_low_deg", "low", Align::right, 5},
                   {"ER_high_deg", "high", Align::right, 5},
                   {"ER_median_deg", "median", Align::right, 5},
                   {"ER_rmse_deg", "RMSE", Align::right, 5},
                   {"epe_initial_px", "EPE [px]", Align::right, 3}};
  std::ranges::move(limit_columns(), std::back_inserter(table.columns));
  table.columns.push_back({"noise", "noise", Align::left, 0, true});
  for (const NoiseLevelRow& row : rows) {
    std::vector<Cell> cells = {row.dataset,
                               row.sequence,
                               row.body,
                               row.estimator,
                               row.level,
                               static_cast<double>(row.n_seeds),
                               100.0 * row.n_estimated / row.n_truth};
    add_summary(row.Et_m, cells);
    add_summary(row.ER_deg, cells);
    cells.push_back(cell(row.epe_initial_px));
    add_limit_cells(row.limit, cells);
    cells.emplace_back(row.noise);
    table.add_row(std::move(cells));
  }
  return table;
}

}  // namespace sextant
