// Table VI (ours): accuracy against the bound.

#include "sextant/eval/report/limit_summary.h"
#include "sextant/eval/report/record_places.h"
#include "sextant/eval/report/tables/paper_sets.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

/// RMS / bound with its interval, from an efficiency.
void add_ratio(const Efficiency* efficiency, double rms, std::vector<Cell>& cells) {
  cells.emplace_back(rms);
  cells.push_back(efficiency ? std::optional(efficiency->bound) : std::nullopt);
  std::optional<IntervalEstimate> ratio;
  if (efficiency) ratio = IntervalEstimate{1 / efficiency->efficiency, std::nullopt};
  if (efficiency && efficiency->interval)
    ratio->interval = Interval{1 / efficiency->interval->high, 1 / efficiency->interval->low};
  add_estimate(ratio, cells);
}

void add_ratio_columns(const MetricDefinition& error, Table& table) {
  const std::string key = error.stem() + "_ratio";
  table.add_columns(
      {{error.key("rms"), fmt::format("{} RMS [{}]", error.symbol, error.unit), Align::right, 5},
       Column::number(error.key("bound"), "bound", 5),
       Column::number(key, "RMS / bound", 2)});
  table.add_columns(range_columns(key + "_low", key + "_high", 2));
}

}  // namespace

Table limit_table(const Evidence& evidence) {
  Table table{
      "Table VI (ours): accuracy against the limit",
      "RMS over pairs and seeds of the error, objects in the camera frame, beside the RMS of the Cramer-Rao "
      "bound from flow and previous depth; intervals over seeds. 1 is the best an "
      "unbiased estimator can do without the current depth, which joint_flow_depth also uses. ANEES is 6 within its "
      "interval for an estimator that knows its own error. Noise as in Table III.",
      {Column::text("set"), Column::text("data"), Column::text("body"), Column::text("estimator")}};
  for (const MetricDefinition* error : bounded_errors()) add_ratio_columns(*error, table);
  table.columns.push_back(Column::number("anees", "ANEES", 2));
  table.add_columns(range_columns("anees_low", "anees_high", 2));
  table.columns.push_back(Column::count("pairs"));
  std::vector<std::string> behind;
  for (const EvidencePart* part : evidence.with(PartRole::sets)) {
    for (const SetData& data : set_data()) {
      for (const auto& [estimator, records] : by_estimator(matching(part->records, data.filter))) {
        for (const auto& [body, estimated] : paper_bodies(records)) {
          if (estimated.empty()) continue;
          const LimitSummary limit = summarize_limit(estimated, {});
          std::vector<Cell> cells = {data.set, set_data_title(data.filter), body, estimator};
          for (const MetricDefinition* error : bounded_errors()) {
            const double rms = rmse(numbers_of(estimated, NumberMap::errors, error->name));
            add_ratio(find_in(limit.efficiency, error->name), rms, cells);
          }
          const std::optional<Consistency>& c = limit.consistency;
          add_estimate(c ? std::optional(IntervalEstimate{c->anees, c->expected}) : std::nullopt, cells);
          cells.emplace_back(estimated.size());
          table.add_row(std::move(cells));
          behind.push_back(records_of_part(part->name));
        }
      }
    }
  }
  add_addresses("pairs", behind, table);
  if (table.rows.empty()) table.notes.push_back("Not measured here: no part with the paper's sets.");
  return table;
}

}  // namespace sextant
