// Table V: velocity errors per sequence and object.

#include <set>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {
namespace {

/// Which objects a column of the paper means: ids of our masks (track + 1); none: all moving objects.
struct Group {
  const char* sequence;
  const char* objects;
  std::set<int> ids;
};
const std::vector<Group> named_groups = {
    {"00", "van", {1}}, {"00", "cyclist", {3}}, {"03", "wagon", {1}}, {"03", "suv", {2}}};

std::set<int> ids_of(const std::string& sequence, const std::string& objects) {
  for (const Group& group : named_groups) {
    if (group.sequence == sequence && group.objects == objects) return group.ids;
  }
  return {};
}

/// The paper's "03" for KITTI's 0003 and for the authors' sample of it.
std::string paper_sequence(const Record& record) {
  if (record.dataset == "vdo" && record.sequence == "kitti_03_demo") return "03";
  if (record.dataset == "kitti" && record.sequence.str().size() == 4) return record.sequence.str().substr(2);
  return "";
}

/// Records of a group under one estimator of one part.
struct GroupRecords {
  RecordRefs with_truth, estimated;
  int first_frame = 0, last_frame = 0;
  std::string data;
};

GroupRecords group_records(const EvidencePart& part, const std::string& estimator, const Json& column) {
  GroupRecords group;
  const std::set<int> ids = ids_of(column.at("sequence"), column.at("objects"));
  for (const Record& record : part.records) {
    if (record.estimator != estimator || column.at("sequence") != paper_sequence(record)) continue;
    if (group.data.empty()) {
      group.first_frame = record.frame - 1;
      group.data = data_title(record.dataset, record.sequence);
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
              const std::string& part, Table& table) {
  const bool measured = group != nullptr && !group->estimated.empty();
  std::optional<double> coverage;
  if (group != nullptr && !group->with_truth.empty()) {
    coverage =
        100.0 * static_cast<double>(group->estimated.size()) / static_cast<double>(group->with_truth.size());
  }
  const auto add = [&](const char* key, const char* title, const std::optional<Measured>& value) {
    PaperRow row{{column.at("sequence"), column.at("objects"), estimator}, title};
    row.published = published_number(column, key);
    row.measured = value;
    if (group != nullptr) row.data = group->data;
    if (group != nullptr && !measured) row.data += ": no moving object of this group within the gates";
    row.records = part;
    std::vector<Cell> cells = published_cells(row);
    cells.push_back(coverage);
    table.add_row(std::move(cells));
  };
  const auto mean_of = [&](NumberMap map, const char* key) {
    return measured ? measure_mean(group->estimated, map, key) : std::nullopt;
  };
  add("tracks", "tracks", measured ? std::optional(count(group->estimated.size())) : std::nullopt);
  add("avg_velocity_kmh", "true velocity [km/h]", mean_of(NumberMap::values, "v_gt_kmh"));
  add("Ev_kmh", "E_v [km/h]", mean_of(NumberMap::errors, "Ev_kmh"));
}

}  // namespace

Table velocity_table(const Evidence& evidence) {
  Table table = published_table(
      "Table V: velocity of objects on KITTI tracking",
      "Preset paper: mean over tracked pairs of the absolute difference of estimated and true speed at the same "
      "point. Tracks: pairs in which the object was estimated; coverage: of those in which it moves by truth. "
      "A part of a sequence has fewer tracks than the whole, and the paper's are those of the whole.",
      {Column::text("sequence"), Column::text("objects"), Column::text("estimator")}, 2);
  table.columns.push_back(Column::number("coverage_percent", "coverage [%]", 1));
  std::vector<const Json*> unmeasured;
  for (const Json& column : evidence.published.at("tab:velocity").at("columns")) {
    bool measured = false;
    for (const EvidencePart* part : evidence.with(PartRole::real)) {
      std::set<std::string> estimators;
      for (const Record& record : part->records) {
        if (column.at("sequence") == paper_sequence(record)) estimators.insert(record.estimator);
      }
      for (const std::string& estimator : estimators) {
        const GroupRecords group = group_records(*part, estimator, column);
        if (group.estimated.empty() && estimator != "joint_flow") continue;
        add_rows(column, estimator, &group, part->name, table);
        measured = true;
      }
    }
    if (!measured) unmeasured.push_back(&column);
  }
  for (const Json* column : unmeasured) add_rows(*column, "joint_flow", nullptr, "", table);
  return table;
}

}  // namespace sextant
