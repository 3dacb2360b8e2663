// The tables of the paper about drives: IV, ego motion of recorded systems and of our estimators with the
// ground-truth floor; V, velocity errors per sequence and object.

#include "sextant/eval/report/tables/paper_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "sextant/stats/summary.h"

namespace sextant {

namespace {

struct EgoError {
  const char* error;
  bool is_published;  ///< under the same key
};
constexpr std::array<EgoError, 4> ego_errors = {
    {{"Et_m", true}, {"ER_deg", true}, {"Et_corrected_m", false}, {"Et_scaled_m", false}}};

/// Ego records by system and sequence.
using Systems = std::map<std::string, std::map<Interned, RecordRefs>>;

Systems systems_of(const EvidencePart& part) {
  Systems systems;
  const auto is_chosen = [](const Record& record) { return record.is_ego() && is_evaluated(record); };
  for (const auto& [system, records] : group_by(records_where(part.records, is_chosen), &Record::estimator))
    systems[system] = group_by(records, &Record::sequence);
  return systems;
}

std::string frames_title(const RecordRefs& records) {
  int first = records.front()->frame;
  int last = first;
  for (const Record* record : records) {
    first = std::min(first, record->frame);
    last = std::max(last, record->frame);
  }
  const Record& record = *records.front();
  return fmt::format("{}, frames {}-{}", data_title(record.dataset, record.sequence), first - 1, last);
}

/// RMS floor of the truth, and the part of the RMSE beyond it.
struct Floor {
  std::optional<double> floor_m, rmse_m, beyond_m;
};

Floor floor_of(const RecordRefs& records) {
  Floor floor;
  std::vector<double> floors, errors;
  for (const Record* record : records) {
    const auto f = find_number(record->values, "step_floor_m");
    const auto e = find_number(record->errors, "Et_m");
    if (f && e) {
      floors.push_back(*f);
      errors.push_back(*e);
    }
  }
  if (floors.empty()) return floor;
  floor.floor_m = rmse(floors);
  floor.rmse_m = rmse(errors);
  floor.beyond_m = std::sqrt(std::max(0.0, *floor.rmse_m * *floor.rmse_m - *floor.floor_m * *floor.floor_m));
  return floor;
}

/// Floors of the truth by sequence and metric key, from the records of recorded systems.
using Floors = std::map<std::string, Record::Numbers>;

Floors floors_of(const Evidence& evidence) {
  Floors floors;
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const Record& record : part->records) {
      for (const char* key : {"lateral_floor_m", "rotation_timing_floor_deg", "rotation_floor_deg"})
        if (const auto floor = find_number(record.values, key)) floors[record.sequence][key] = *floor;
    }
  }
  return floors;
}

/// RMS over the pairs of the floors of their sequences.
std::optional<double> rms_floor(const RecordRefs& records, const Floors& floors, const char* key) {
  std::vector<double> numbers;
  for (const Record* record : records) {
    const auto of_sequence = floors.find(paper().recorded_sequence(*record));
    if (of_sequence == floors.end()) continue;
    if (const auto floor = find_number(of_sequence->second, key)) numbers.push_back(*floor);
  }
  return numbers.empty() ? std::nullopt : std::optional(rmse(numbers));
}

void add_ego_rows(const std::string& sequence, const std::string& system, const RecordRefs& records,
                  const Json* published, const std::string& data, const std::string& part,
                  const Floors& floors, PublishedTable& table) {
  const Floor floor = floor_of(records);
  for (const EgoError& q : ego_errors) {
    PaperRow row{
        .group = sequence, .estimator = system, .quantity = metric(NumberMap::errors, q.error).heading()};
    if (published != nullptr && q.is_published) row.published = published_number(*published, q.error);
    row.measured = measure_mean(records, NumberMap::errors, q.error);
    if (!row.measured && !row.published) continue;
    row.data = data;
    if (!records.empty()) row.dataset = records.front()->dataset.str();
    row.records = part;
    if (q.error == std::string("Et_m")) {
      row.more = {{"Et_rmse_m", floor.rmse_m},
                  {"floor_m", floor.floor_m},
                  {"beyond_floor_m", floor.beyond_m},
                  {"lateral_floor_m", rms_floor(records, floors, "lateral_floor_m")}};
    } else if (q.error == std::string("ER_deg")) {
      const std::vector<double> rotations = numbers_of(records, NumberMap::errors, "ER_deg");
      if (!rotations.empty()) row.more["ER_rmse_deg"] = rmse(rotations);
      for (const char* key : {"rotation_timing_floor_deg", "rotation_floor_deg"})
        row.more[key] = rms_floor(records, floors, key);
    }
    table.rows.push_back(std::move(row));
  }
}

}  // namespace

PublishedTable ego_motion_table(const Evidence& evidence) {
  const Json& published = evidence.published.at("tab:cam_err");
  PublishedTable table{
      .number = "IV",
      .labels = {{Column::text("sequence"), &PaperRow::group},
                 {Column::text("system"), &PaperRow::estimator}},
      .decimals = 4,
      .more = {Column::number("Et_rmse_m", "E_t RMSE [m]", 4), Column::number("floor_m", "floor [m]", 4),
               Column::number("beyond_floor_m", "beyond the floor [m]", 4),
               Column::number("lateral_floor_m", "lateral floor [m]", 4),
               Column::number("ER_rmse_deg", "E_R RMSE [deg]", 4),
               Column::number("rotation_timing_floor_deg", "E_R floor, timing [deg]", 4),
               Column::number("rotation_floor_deg", "E_R floor, turn rates [deg]", 4)}};
  const Floors floors = floors_of(evidence);
  const PaperEstimator& reference = paper().reference;
  for (const auto& [column, system] : {std::pair<std::string, std::string>{"proposed", "paper, proposed"},
                                       {reference.column, reference.title + " (reference)"}}) {
    add_ego_rows("12 sequences", system, {}, &published.at(column), "the paper's own runs", "", floors,
                 table);
  }
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const auto& [system, sequences] : systems_of(*part)) {
      RecordRefs all;
      for (const auto& [sequence, records] : sequences) {
        add_ego_rows(sequence, system, records, nullptr, frames_title(records), part->name, floors, table);
        all.insert(all.end(), records.begin(), records.end());
      }
      add_ego_rows(fmt::format("all {}", sequences.size()), system, all, nullptr,
                   fmt::format("{}, {} sequences", paper().recorded_title, sequences.size()), part->name,
                   floors, table);
    }
  }
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    for (const auto& [system, sequences] : systems_of(*part)) {
      const Json* proposed = system == paper().method ? &published.at("proposed") : nullptr;
      for (const auto& [sequence, records] : sequences)
        add_ego_rows(sequence, system, records, proposed, frames_title(records), part->name, floors, table);
    }
  }
  return table;
}

namespace {

/// Records of a group of objects for one estimator and experiment.
struct GroupRecords {
  RecordRefs with_truth, estimated;
  int first_frame = 0, last_frame = 0;
  std::string data, dataset;
};

/// Returns true if the record is of the sequence of a column of the published table. The list `sequences` of
/// zhang2020_data.json names the paper's sequence for each of ours.
bool is_of(const Json& published_column, const Record& record) {
  return published_column.at("sequence") == paper().sequence_of(record.dataset, record.sequence);
}

GroupRecords group_records(const EvidencePart& part, const std::string& estimator,
                           const Json& published_column) {
  GroupRecords group;
  // By the list `objects` of zhang2020_data.json, which assigns mask ids to the paper's objects; empty for
  // all moving objects.
  const std::set<int> ids = paper().ids_of(published_column.at("sequence"), published_column.at("objects"));
  for (const Record& record : part.records) {
    if (record.estimator != estimator || !is_of(published_column, record)) continue;
    if (group.data.empty()) {
      group.first_frame = record.frame - 1;
      group.data = data_title(record.dataset, record.sequence);
      group.dataset = record.dataset.str();
    }
    group.last_frame = std::max(group.last_frame, record.frame);
    // has_truth() excludes objects without true motion, and objects that are static by truth.
    if (record.is_ego() || !has_truth(record)) continue;
    if (!ids.empty() && !ids.contains(body_order(record.body))) continue;
    group.with_truth.push_back(&record);
    if (record.status == Status::ok && record.errors.contains("Ev_kmh")) group.estimated.push_back(&record);
  }
  group.data += fmt::format(", frames {}-{}", group.first_frame, group.last_frame);
  return group;
}

Measured count(size_t n) {
  return {{static_cast<double>(n), std::nullopt}, std::nullopt, static_cast<int>(n), /*n_seeds=*/1};
}

void add_velocity_rows(const Json& published_column, const std::string& estimator, const GroupRecords* group,
                       const std::string& part, PublishedTable& table) {
  const bool measured = group != nullptr && !group->estimated.empty();
  PaperRow row{.group = published_column.at("sequence"),
               .body = published_column.at("objects"),
               .estimator = estimator};
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
    row.published = published_number(published_column, key);
    row.measured = value;
    table.rows.push_back(row);
  };
  // measure_mean() of published_rows.cc: the mean over these records and its interval.
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
  std::vector<const Json*> without_row;
  for (const Json& published_column : evidence.published.at("tab:velocity").at("columns")) {
    bool has_row = false;  // of an experiment on real data
    // Experiments on real data (for column 03 `demo`, plan eval/plans/reproduce/demo.json), and logs. Their
    // records are parts/NAME/records.jsonl; those of an experiment come from evaluate_pair()
    // (eval/experiment/evaluate_pair.cc).
    for (const EvidencePart* part : evidence.with({PartRole::real, PartRole::recorded_objects})) {
      std::set<std::string> estimators;
      for (const Record& record : part->records) {
        if (is_of(published_column, record)) estimators.insert(record.estimator);
      }
      for (const std::string& estimator : estimators) {
        const GroupRecords group = group_records(*part, estimator, published_column);
        if (group.estimated.empty() && estimator != paper().method) continue;
        add_velocity_rows(published_column, estimator, &group, part->name, table);
        has_row |= part->role == PartRole::real;
      }
    }
    if (!has_row) without_row.push_back(&published_column);
  }
  for (const Json* published_column : without_row)
    add_velocity_rows(*published_column, paper().method, nullptr, "", table);
  return table;
}

}  // namespace sextant
