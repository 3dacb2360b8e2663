#include "sextant/eval/report/errors_by_level.h"

#include <array>

#include "sextant/base/machine.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

NoiseLevelRow summarize_level(const NoiseLevel& level, const BootstrapOptions& options) {
  const NoiseLevelKey& key = level.key();
  NoiseLevelRow row{{}, key.dataset, key.sequence, key.body, key.estimator, key.noise, key.level};
  row.n_seeds = static_cast<int>(level.n_seeds());
  row.n_truth = static_cast<int>(level.n_truth());
  row.n_estimated = static_cast<int>(level.n_estimated());
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    if (level.has(e)) row.errors[compared_errors()[e]->name] = summarize_sample(level.sample(e, level.clusters()), options);
  }
  row.limit = summarize_limit(level, options);
  if (level.epe_initial_px().n > 0) row.epe_initial_px = level.epe_initial_px().mean();
  return row;
}

/// One statistic of SampleSummary as a column; `detail` columns are in CSV and JSON only.
struct StatisticColumn {
  IntervalEstimate SampleSummary::*member;
  const char* name;
  const char* title;
  bool detail;
  bool interval_in_text;
};
constexpr std::array<StatisticColumn, 7> statistic_columns = {{
    {&SampleSummary::mean, "mean", "mean", false, true},
    {&SampleSummary::rmse, "rmse", "RMSE", false, false},
    {&SampleSummary::q05, "q05", "q05", true, false},
    {&SampleSummary::q25, "q25", "q25", true, false},
    {&SampleSummary::median, "median", "median", false, false},
    {&SampleSummary::q75, "q75", "q75", true, false},
    {&SampleSummary::q95, "q95", "q95", false, false},
}};

void add_columns(const MetricDefinition& error, Table& table) {
  const int decimals = error.digits + 1;
  for (const StatisticColumn& c : statistic_columns) {
    const std::string name = c.name;
    const std::string title = c.interval_in_text
                                  ? fmt::format("{} {} [{}]", error.symbol, c.title, error.unit)
                                  : std::string(c.title);
    table.columns.push_back({error.key(name), title, Align::right, decimals, false, c.detail});
    std::vector<Column> range = range_columns(error.key(name + "_low"), error.key(name + "_high"), decimals);
    for (Column& column : range) column.detail = !c.interval_in_text;
    table.add_columns(std::move(range));
  }
}

}  // namespace

std::vector<NoiseLevelRow> noise_levels(const NoiseSweep& sweep, int jobs, const BootstrapOptions& options) {
  std::vector<NoiseLevelRow> all(sweep.levels.size());
  parallel_for(static_cast<int>(all.size()), jobs, [&](int i) {
    const auto at = static_cast<size_t>(i);
    all[at] = summarize_level(*sweep.levels[at], options);
    all[at].parameter = sweep.parameter;
  });
  std::erase_if(all, [](const NoiseLevelRow& row) { return row.n_truth == 0; });
  return all;
}

Table noise_level_table(const std::vector<NoiseLevelRow>& rows) {
  Table table{
      "Errors by noise level",
      "Over the estimated pairs of all seeds. Interval of the mean: bootstrap with a seed's pairs as one "
      "cluster (with one seed: frames). Objects: motion in the camera frame. Efficiency: Cramer-Rao bound "
      "(RMS) / RMSE, 1 at best but for bias and current depths; ANEES: mean normalised error squared, within "
      "its interval for an estimator that knows its own error. CSV and JSON have more quantiles and every "
      "interval.",
      folded_columns({"parameter", "dataset", "sequence"})};
  table.columns.push_back(Column::text("body"));
  table.add_columns(folded_columns({"estimator"}));
  table.add_columns({Column::number("level", 3), Column::count("n_seeds", "seeds"),
                     Column::number("coverage_percent", "coverage [%]", 1)});
  const std::vector<const MetricDefinition*> errors = metrics_for(compared);
  for (const MetricDefinition* error : errors) add_columns(*error, table);
  table.columns.push_back(Column::number("epe_initial_px", "EPE [px]", 3));
  table.add_columns(limit_columns());
  table.columns.push_back(Column::text("noise").only_in_files());
  for (const NoiseLevelRow& row : rows) {
    std::vector<Cell> cells = {
        row.parameter, row.dataset, row.sequence, row.body,
        row.estimator, row.level,   row.n_seeds,  100.0 * row.n_estimated / row.n_truth};
    for (const MetricDefinition* error : errors) {
      const SampleSummary* summary = find_in(row.errors, error->name);
      for (const StatisticColumn& c : statistic_columns)
        add_estimate(summary ? std::optional(summary->*c.member) : std::nullopt, cells);
    }
    cells.push_back(row.epe_initial_px);
    add_limit_cells(row.limit, cells);
    cells.emplace_back(row.noise);
    table.add_row(std::move(cells));
  }
  return table;
}

}  // namespace sextant
