// Table IV: ego motion of recorded systems and of our estimators on recorded drives, with the ground-truth
// floor.

#include <array>
#include <cmath>
#include <map>

#include "sextant/eval/report/tables/paper_table.h"
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
using Systems = std::map<std::string, std::map<std::string, RecordRefs>>;

struct Source {
  const EvidencePart* part;
  Systems systems;
};

Systems systems_of(const EvidencePart& part) {
  Systems systems;
  for (const Record& record : part.records) {
    if (!record.is_ego() || record.status != Status::ok || !has_truth(record)) continue;
    systems[record.estimator][record.sequence].push_back(&record);
  }
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

void add_rows(const std::string& sequence, const std::string& system, const RecordRefs& records,
              const Json* published, const std::string& data, const std::string& part, const Floors& floors,
              PublishedTable& table) {
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
    add_rows("12 sequences", system, {}, &published.at(column), "the paper's own runs", "", floors, table);
  }
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const auto& [system, sequences] : systems_of(*part)) {
      RecordRefs all;
      for (const auto& [sequence, records] : sequences) {
        add_rows(sequence, system, records, nullptr, frames_title(records), part->name, floors, table);
        all.insert(all.end(), records.begin(), records.end());
      }
      add_rows(fmt::format("all {}", sequences.size()), system, all, nullptr,
               fmt::format("{}, {} sequences", paper().recorded_title, sequences.size()), part->name, floors,
               table);
    }
  }
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    for (const auto& [system, sequences] : systems_of(*part)) {
      const Json* proposed = system == paper().method ? &published.at("proposed") : nullptr;
      for (const auto& [sequence, records] : sequences)
        add_rows(sequence, system, records, proposed, frames_title(records), part->name, floors, table);
    }
  }
  return table;
}

}  // namespace sextant
