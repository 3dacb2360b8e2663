// Table VI (ours): errors relative to the Cramer-Rao bound.

#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

struct LimitRow {
  std::string set, data, body, estimator, part;
  RecordRefs estimated;
  LimitSummary limit;
};

void add_error(const MetricDefinition& error, Fields<LimitRow>& fields) {
  const std::string key = error.stem() + "_ratio", name = error.name;
  fields.add(
      Column::number(error.key("rms"), fmt::format("{} RMS [{}]", error.symbol, error.unit), 5),
      [name](const LimitRow& row) { return rmse(numbers_of(row.estimated, NumberMap::errors, name)); });
  Fields<Efficiency> of_limit = {{Column::number(error.key("bound"), "bound", 5), &Efficiency::bound}};
  of_limit.add(estimate_fields(Column::number(key, "RMS / bound", 2), key + "_low", key + "_high"),
               [](const Efficiency& efficiency) { return std::optional(efficiency.ratio()); });
  fields.add(of_limit, [name](const LimitRow& row) { return find_in(row.limit.efficiency, name); });
}

}  // namespace

Table limit_table(const Evidence& evidence) {
  std::vector<LimitRow> rows;
  for (const EvidencePart* part : evidence.with(PartRole::sets)) {
    for (const SetData& data : paper().sets) {
      for (const auto& [estimator, records] : by_estimator(matching(part->records, data.filter))) {
        for (const auto& [body, estimated] : paper_bodies(records)) {
          if (estimated.empty()) continue;
          rows.push_back({data.set, data_title(data.filter), body, estimator, part->name, estimated,
                          summarize_limit(level_of(estimated), {})});
        }
      }
    }
  }
  Fields<LimitRow> fields = {{Column::text("set"), &LimitRow::set},
                             {Column::text("data"), &LimitRow::data},
                             {Column::text("body"), &LimitRow::body},
                             {Column::text("estimator"), &LimitRow::estimator}};
  for (const MetricDefinition* error : bounded_errors()) add_error(*error, fields);
  Fields<Consistency> anees = {{Column::number("anees", "ANEES", 2), &Consistency::anees}};
  anees.add_range(range_columns("anees_low", "anees_high", 2),
                  [](const Consistency& c) { return &c.expected; });
  fields.add(anees, [](const LimitRow& row) { return row.limit.consistency; });
  fields.add(Column::count("pairs").leading_to("pairs_file"),
             [](const LimitRow& row) { return row.estimated.size(); });
  fields.add(Column::text("pairs_file").only_in_files(),
             [](const LimitRow& row) { return records_of_part(row.part); });
  return numbered_table("VI", "Not measured here: no experiment with the paper's sets.", fields, rows);
}

}  // namespace sextant
