// Table V: velocity errors per sequence and object.

#include <algorithm>
#include <set>

#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {
namespace {

/// Records of a group of objects for one estimator and experiment.
struct GroupRecords {
  RecordRefs with_truth, estimated;
  int first_frame = 0, last_frame = 0;
  std::string data, dataset;
};

bool is_of(const Json& column, const Record& record) {
  return column.at("sequence") == paper().sequence_of(record.dataset, record.sequence);
}

GroupRecords group_records(const EvidencePart& part, const std::string& estimator, const Json& column) {
  GroupRecords group;
  const std::set<int> ids = paper().ids_of(column.at("sequence"), column.at("objects"));
  for (const Record& record : part.records) {
    if (record.estimator != estimator || !is_of(column, record)) continue;
    if (group.data.empty()) {
      group.first_frame = record.frame - 1;
      group.data = data_title(record.dataset, record.sequence);
      group.dataset = record.dataset.str();
    }
    group.last_frame = std::max(group.last_frame, record.frame);
    if (record.is_ego() || !has_truth(record)) continue;
    if (!ids.empty() && !ids.contains(body_order(record.body))) continue;
    group.with_truth.push_back(&record);
    if (record.status == Status::ok && record.errors.contains("Ev_kmh")) group.estimated.push_back(&record);
  }
  group.data += fmt::format(", frames {}-{}", group.first_frame, group.last_frame);
  return group;
}

Measured count(size_t n) {
  Measured measured;
  measured.value = static_cast<double>(n);
  measured.n_pairs = static_cast<int>(n);
  measured.n_seeds = 1;
  return measured;
}

void add_rows(const Json& column, const std::string& estimator, const GroupRecords* group,
              const std::string& part, PublishedTable& table) {
  const bool measured = group != nullptr && !group->estimated.empty();
  PaperRow row{.group = column.at("sequence"), .body = column.at("objects"), .estimator = estimator};
  row.records = part;
  if (group != nullptr) row.data = group->data;
  if (group != nullptr) row.dataset = group->dataset;
  if (group != nullptr && !measured) row.data += ": no moving object of this group within the gates";
  if (group != nullptr && !group->with_truth.empty()) {
    row.more["coverage_percent"] =
        100.0 * static_cast<double>(group->estimated.size()) / static_cast<double>(group->with_truth.size());
  }
  const auto add = [&](const char* key, const char* title, const std::optional<Measured>& value) {
    row.quantity = title;
    row.published = published_number(column, key);
    row.measured = value;
    table.rows.push_back(row);
  };
  const auto mean_of = [&](NumberMap map, const char* key) {
    return measured ? measure_mean(group->estimated, map, key) : std::nullopt;
  };
  add("tracks", "tracks", measured ? std::optional(count(group->estimated.size())) : std::nullopt);
  add("avg_velocity_kmh", "true velocity [km/h]", mean_of(NumberMap::values, "v_gt_kmh"));
  add("Ev_kmh", "E_v [km/h]", mean_of(NumberMap::errors, "Ev_kmh"));
}

}  // namespace

PublishedTable velocity_table(const Evidence& evidence) {
  PublishedTable table{.number = "V",
                       .labels = {{Column::text("sequence"), &PaperRow::group},
                                  {Column::text("objects"), &PaperRow::body},
                                  {Column::text("estimator"), &PaperRow::estimator}},
                       .decimals = 2,
                       .more = {Column::number("coverage_percent", "coverage [%]", 1)}};
  std::vector<const Json*> unmeasured;
  for (const Json& column : evidence.published.at("tab:velocity").at("columns")) {
    bool measured = false;  // by an estimator that was run here
    for (const EvidencePart* part : evidence.with({PartRole::real, PartRole::recorded_objects})) {
      std::set<std::string> estimators;
      for (const Record& record : part->records) {
        if (is_of(column, record)) estimators.insert(record.estimator);
      }
      for (const std::string& estimator : estimators) {
        const GroupRecords group = group_records(*part, estimator, column);
        if (group.estimated.empty() && estimator != paper().method) continue;
        add_rows(column, estimator, &group, part->name, table);
        measured |= part->role == PartRole::real;
      }
    }
    if (!measured) unmeasured.push_back(&column);
  }
  for (const Json* column : unmeasured) add_rows(*column, paper().method, nullptr, "", table);
  return table;
}

}  // namespace sextant
