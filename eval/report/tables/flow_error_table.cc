// Table II: distance, area and flow error of static points and objects of one set.

#include <array>

#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
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
  return records.empty() ? records : by_estimator(records).at(records.front()->estimator);
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

}  // namespace sextant
