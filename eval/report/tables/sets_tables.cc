// The tables of the paper's three sets: II, III, and VI with the bounds of their errors (ours).

#include <array>

#include "sextant/eval/report/noise_tables.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/summary.h"

namespace sextant {

// ---- Table III: the three sets for "motion only", "joint" and our estimator.

namespace {

constexpr std::array<const char*, 2> set_errors = {"Et_m", "ER_deg"};

PaperRow row_of(const Json& line, const std::string& estimator, const char* error) {
  PaperRow row{.group = line.at("set"), .body = line.at("body"), .estimator = estimator};
  row.quantity = metric(NumberMap::errors, error).heading();
  if (const auto column = paper().column_of(estimator))
    row.published = published_number(line.at(*column), error);
  return row;
}

/// Adds the rows of one line of the paper for one kind of data; returns false if it was not measured.
bool add_measured(const Json& line, const SetData& data, const EvidencePart& part, PublishedTable& table) {
  const RecordRefs records = matching(part.records, data.filter);
  const auto groups = group_by(records, &Record::estimator);
  const std::string body = paper_body(line.at("body"));
  for (const std::string& estimator : distinct(records, &Record::estimator)) {
    const auto bodies = paper_bodies(groups.at(estimator));
    const RecordRefs* of_body = find_in(bodies, body);
    for (const char* error : set_errors) {
      PaperRow row = row_of(line, estimator, error);
      if (of_body) row.measured = measure_mean(*of_body, NumberMap::errors, error);
      if (!row.published && !row.measured)
        continue;  // a system that estimates only the camera has no objects
      row.data = data_title(data.filter);
      row.dataset = data.filter.dataset;
      row.records = part.name;
      table.rows.push_back(std::move(row));
    }
  }
  return !records.empty();
}

/// Lines of the paper's table by set, in order.
std::vector<std::pair<std::string, std::vector<Json>>> published_sets(const Json& published) {
  std::vector<std::pair<std::string, std::vector<Json>>> sets;
  for (const Json& line : published.at("rows")) {
    const std::string set = line.at("set");
    if (sets.empty() || sets.back().first != set) sets.push_back({set, {}});
    sets.back().second.push_back(line);
  }
  return sets;
}

}  // namespace

PublishedTable sets_table(const Evidence& evidence) {
  PublishedTable table{.number = "III",
                       .labels = {{Column::text("set").folded(), &PaperRow::group},
                                  {Column::text("body"), &PaperRow::body},
                                  {Column::text("estimator"), &PaperRow::estimator}},
                       .decimals = 4};
  for (const auto& [set, lines] : published_sets(evidence.published.at("tab:mot_all"))) {
    bool measured = false;
    for (const EvidencePart* part : evidence.with({PartRole::sets, PartRole::sets_paper})) {
      for (const SetData& data : paper().sets) {
        if (data.set != set) continue;
        for (const Json& line : lines) measured |= add_measured(line, data, *part, table);
      }
    }
    if (measured) continue;
    for (const Json& line : lines) {
      for (const std::string& estimator : {paper().baseline, paper().method}) {
        for (const char* error : set_errors) table.rows.push_back(row_of(line, estimator, error));
      }
    }
  }
  return table;
}

// ---- Table II: distance, area and flow error of static points and objects of one set.

namespace {

struct FlowQuantity {
  const char* published_key;
  const char* title;
  NumberMap map;
  const char* key;
  double factor;
};
constexpr std::array<FlowQuantity, 4> flow_quantities = {{
    {"object_distance_m", "distance [m]", NumberMap::values, "distance_m", 1},
    {"object_area_percent", "area [%]", NumberMap::values, "area_fraction", 100},
    {"epe_x_px", "EPE x [px]", NumberMap::errors, "epe_measured_x_px", 1},
    {"epe_y_px", "EPE y [px]", NumberMap::errors, "epe_measured_y_px", 1},
}};

/// Level at which the noise has the standard deviations of Table II.
constexpr double level_of_table_2 = 1;

RecordRefs of_first_estimator(const EvidencePart& part, const RecordFilter& filter) {
  RecordRefs records = matching(part.records, filter);
  std::erase_if(records, [](const Record* record) { return record->level != level_of_table_2; });
  return records.empty() ? records : of_estimator(records, records.front()->estimator);
}

/// Adds a row for every printed value, with the value measured in these records; without records, only the
/// printed values.
void add_flow_rows(const Json& published, const RecordRefs& records, const RecordFilter& filter,
                   const std::string& part, PublishedTable& table) {
  const auto bodies = paper_bodies(records);
  const Json& columns = published.at("columns");
  for (size_t i = 0; i < columns.size(); ++i) {
    // "Static" is the background, whose values are in the camera's record.
    const auto body = bodies.find(columns[i] == "Static" ? "Ego" : columns[i].get<std::string>());
    for (const FlowQuantity& q : flow_quantities) {
      const Json& value = published.at(q.published_key).at(i);
      if (value.is_null()) continue;
      PaperRow row{.body = columns[i].get<std::string>(), .quantity = q.title};
      row.published = value.get<double>();
      if (body != bodies.end()) row.measured = measure_mean(body->second, q.map, q.key);
      if (row.measured) row.measured = row.measured->scaled(q.factor);
      if (!records.empty()) row.data = data_title(filter);
      row.dataset = filter.dataset;
      row.records = part;
      table.rows.push_back(std::move(row));
    }
  }
}

}  // namespace

PublishedTable flow_error_table(const Evidence& evidence) {
  PublishedTable table{.number = "II", .labels = {{Column::text("body"), &PaperRow::body}}, .decimals = 2};
  const Json& published = evidence.published.at("tab:flow_err");
  bool measured = false;
  for (const EvidencePart* part : evidence.with(PartRole::noise)) {
    if (part->sweep.parameter != "flow.scale") continue;
    for (const SetData& data : paper().sets) {
      const RecordRefs records = of_first_estimator(*part, data.filter);
      if (data.set != paper().flow_error_set || records.empty()) continue;
      add_flow_rows(published, records, data.filter, part->name, table);
      measured = true;
    }
  }
  if (!measured) add_flow_rows(published, {}, {}, "", table);
  return table;
}

// ---- Table VI (ours): errors relative to the Cramer-Rao bound.

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
      for (const auto& [estimator, records] :
           group_by(matching(part->records, data.filter), &Record::estimator)) {
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
