// Table II: distance, area and flow error of static points and objects of S18-F124-134.

#include <array>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_sets.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {
namespace {

struct Quantity {
  const char* published_key;
  const char* title;
  NumberMap map;
  const char* key;
  double factor;
};
constexpr std::array<Quantity, 4> quantities = {{
    {"object_distance_m", "distance [m]", NumberMap::values, "distance_m", 1},
    {"object_area_percent", "area [%]", NumberMap::values, "area_fraction", 100},
    {"epe_x_px", "EPE x [px]", NumberMap::errors, "epe_measured_x_px", 1},
    {"epe_y_px", "EPE y [px]", NumberMap::errors, "epe_measured_y_px", 1},
}};

void scale(double factor, Measured& m) {
  m.value *= factor;
  for (std::optional<Interval>* interval : {&m.interval, &m.one_run}) {
    if (*interval) *interval = Interval{(*interval)->low * factor, (*interval)->high * factor};
  }
}

/// The level at which the noise has the deviations of Table II.
constexpr double level_of_table_2 = 1;

RecordRefs of_first_estimator(const EvidencePart& part, const RecordFilter& filter) {
  RecordRefs records = matching(part.records, filter);
  std::erase_if(records, [](const Record* record) { return record->level != level_of_table_2; });
  return records.empty() ? records : by_estimator(records).at(records.front()->estimator);
}

/// Rows of every printed value, beside what these records say of it; without records the values alone.
void add_rows(const Json& published, const RecordRefs& records, const RecordFilter& filter,
              const std::string& part, Table& table) {
  const auto bodies = paper_bodies(records);
  const Json& columns = published.at("columns");
  for (size_t i = 0; i < columns.size(); ++i) {
    // "Static" is the background, which the camera's record stands for.
    const auto body = bodies.find(columns[i] == "Static" ? "Ego" : columns[i].get<std::string>());
    for (const Quantity& q : quantities) {
      const Json& value = published.at(q.published_key).at(i);
      if (value.is_null()) continue;
      PaperRow row{{columns[i].get<std::string>()}, q.title};
      row.published = value.get<double>();
      if (body != bodies.end()) row.measured = measure_mean(body->second, q.map, q.key);
      if (row.measured) scale(q.factor, *row.measured);
      if (!records.empty()) row.data = set_data_title(filter);
      row.records = part;
      add_published_row(row, table);
    }
  }
}

}  // namespace

Table flow_error_table(const Evidence& evidence) {
  Table table = published_table(
      "Table II: flow error of S18-F124-134",
      "EPE on one axis: mean absolute error over all points of the body. Distance: median depth of an "
      "object's points; area: of its mask. Of the paper's PWC-Net only these numbers are known: they are "
      "injected as the deviations of Gaussian noise, as in the paper's own sweep, and what came out is "
      "shown. A Gaussian of deviation s has a mean absolute error of 0.80 s, so the harness that calls s the "
      "EPE stays 20 % below it.",
      {Column::text("body")}, 2);
  const Json& published = evidence.published.at("tab:flow_err");
  bool measured = false;
  for (const EvidencePart* part : evidence.with(PartRole::noise)) {
    if (part->sweep.parameter != "flow.scale") continue;
    for (const SetData& data : set_data()) {
      const RecordRefs records = of_first_estimator(*part, data.filter);
      if (data.set != "S18-F124-134" || records.empty()) continue;
      add_rows(published, records, data.filter, part->name, table);
      measured = true;
    }
  }
  if (!measured) add_rows(published, {}, {}, "", table);
  return table;
}

}  // namespace sextant
