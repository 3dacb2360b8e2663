// Table VI (ours): accuracy against the bound.

#include "sextant/eval/report/limit_summary.h"
#include "sextant/eval/report/tables/paper_sets.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

double rmse_of(const RecordRefs& records, const char* key) {
  std::vector<double> values;
  for (const Record* record : records) values.push_back(record->errors.at(key));
  return rmse(values);
}

std::optional<double> inverse(const std::optional<double>& x) {
  return x ? std::optional(1 / *x) : std::nullopt;
}

/// RMS / bound with its interval, from an efficiency.
void add_ratio(const std::optional<Efficiency>& efficiency, double rms, std::vector<Cell>& cells) {
  cells.emplace_back(rms);
  cells.push_back(cell(efficiency ? std::optional(efficiency->bound) : std::nullopt));
  cells.push_back(cell(efficiency ? inverse(efficiency->efficiency) : std::nullopt));
  const bool has_interval = efficiency && efficiency->interval;
  cells.push_back(cell(has_interval ? inverse(efficiency->interval->high) : std::nullopt));
  cells.push_back(cell(has_interval ? inverse(efficiency->interval->low) : std::nullopt));
}

void add_ratio_columns(const std::string& symbol, const std::string& key, const std::string& unit,
                       Table& table) {
  const auto add = [&](const std::string& name, const std::string& title, int decimals) {
    table.columns.push_back({name, title, Align::right, decimals});
  };
  add(key + "_rms_" + unit, symbol + " RMS [" + unit + "]", 5);
  add(key + "_bound_" + unit, "bound", 5);
  add(key + "_ratio", "RMS / bound", 2);
  add(key + "_ratio_low", "low", 2);
  table.columns.back().range = "95 % interval";
  add(key + "_ratio_high", "high", 2);
}

}  // namespace

Table limit_table(const Evidence& evidence) {
  Table table;
  table.title = "Table VI (ours): accuracy against the limit";
  table.caption =
      "RMS over pairs and seeds of the error, objects in the camera frame, beside the RMS of the Cramer-Rao "
      "bound from flow and previous depth; intervals over seeds. 1 is the best "
      "an "
      "unbiased estimator can do without the current depth, which joint_flow_depth also uses. ANEES is 6 "
      "within its "
      "interval for an estimator that knows its own error. Noise as in Table III.";
  table.columns = {{"set", "set", Align::left},
                   {"data", "data", Align::left},
                   {"body", "body", Align::left},
                   {"estimator", "estimator", Align::left}};
  add_ratio_columns("E_t", "Et", "m", table);
  add_ratio_columns("E_R", "ER", "deg", table);
  table.columns.push_back({"anees", "ANEES", Align::right, 2});
  table.columns.push_back({"anees_low", "low", Align::right, 2});
  table.columns.back().range = "95 % interval";
  table.columns.push_back({"anees_high", "high", Align::right, 2});
  table.columns.push_back({"pairs", "pairs", Align::right, 0});
  for (const EvidencePart* part : evidence.with(PartRole::sets)) {
    for (const SetData& data : set_data()) {
      std::map<std::string, std::vector<Record>> by_estimator;
      for (const Record& record : part->sweep.records) {
        if (data.filter.matches(record)) by_estimator[record.estimator].push_back(record);
      }
      for (const auto& [estimator, records] : by_estimator) {
        for (const auto& [body, estimated] : paper_bodies(records, data.filter)) {
          if (estimated.empty()) continue;
          const LimitSummary limit = summarize_limit(estimated, {});
          std::vector<Cell> cells = {data.set, set_data_title(data.filter), body, estimator};
          add_ratio(limit.Et, rmse_of(estimated, "Et_m"), cells);
          add_ratio(limit.ER, rmse_of(estimated, "ER_deg"), cells);
          const std::optional<Consistency>& c = limit.consistency;
          cells.push_back(cell(c ? std::optional(c->anees) : std::nullopt));
          cells.push_back(cell(c ? std::optional(c->expected.low) : std::nullopt));
          cells.push_back(cell(c ? std::optional(c->expected.high) : std::nullopt));
          cells.emplace_back(static_cast<double>(estimated.size()));
          table.add_row(std::move(cells));
        }
      }
    }
  }
  if (table.rows.empty()) table.notes.push_back("Not measured here: no part with the paper's sets.");
  return table;
}

}  // namespace sextant
