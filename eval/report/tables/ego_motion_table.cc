// Table IV: ego motion of recorded systems and of ours on KITTI tracking, with the ground-truth floor.

#include <array>
#include <cmath>
#include <map>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/kitti_sequence.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

struct Quantity {
  const char* error;
  bool is_published;  ///< under the same key
};
constexpr std::array<Quantity, 4> quantities = {
    {{"Et_m", true}, {"ER_deg", true}, {"Et_corrected_m", false}, {"Et_scaled_m", false}}};

/// system -> sequence -> its ego records.
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

/// RMS floor of the truth and what of the RMSE is beyond it.
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

/// Floors of the truth by sequence and metric key, from the records that have them: those of recorded systems.
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

/// RMS over the pairs of what their sequences have.
std::optional<double> rms_floor(const RecordRefs& records, const Floors& floors, const char* key) {
  std::vector<double> numbers;
  for (const Record* record : records) {
    const auto of_sequence = floors.find(kitti_sequence(*record));
    if (of_sequence == floors.end()) continue;
    if (const auto floor = find_number(of_sequence->second, key)) numbers.push_back(*floor);
  }
  return numbers.empty() ? std::nullopt : std::optional(rmse(numbers));
}

class Builder {
 public:
  Builder(Table& table, Floors floors) : table_(table), floors_(std::move(floors)) {}

  void add(const std::string& sequence, const std::string& system, const RecordRefs& records,
           const Json* published, const std::string& data, const std::string& part) {
    const Floor floor = floor_of(records);
    for (const Quantity& q : quantities) {
      PaperRow row{{sequence, system}, metric(NumberMap::errors, q.error).heading()};
      if (published != nullptr && q.is_published) row.published = published_number(*published, q.error);
      row.measured = measure_mean(records, NumberMap::errors, q.error);
      if (!row.measured && !row.published) continue;
      row.data = data;
      row.records = part;
      std::vector<Cell> cells = published_cells(row);
      const bool is_Et = q.error == std::string("Et_m");
      cells.push_back(cell(is_Et ? floor.rmse_m : std::nullopt));
      cells.push_back(cell(is_Et ? floor.floor_m : std::nullopt));
      cells.push_back(cell(is_Et ? floor.beyond_m : std::nullopt));
      const bool is_ER = q.error == std::string("ER_deg");
      cells.push_back(cell(is_Et ? rms_floor(records, floors_, "lateral_floor_m") : std::nullopt));
      const std::vector<double> rotations = numbers_of(records, NumberMap::errors, "ER_deg");
      cells.push_back(is_ER && !rotations.empty() ? Cell(rmse(rotations)) : Cell());
      for (const char* key : {"rotation_timing_floor_deg", "rotation_floor_deg"})
        cells.push_back(cell(is_ER ? rms_floor(records, floors_, key) : std::nullopt));
      table_.add_row(std::move(cells));
    }
  }

 private:
  Table& table_;
  Floors floors_;
};

}  // namespace

Table ego_motion_table(const Evidence& evidence) {
  const Json& published = evidence.published.at("tab:cam_err");
  Table table = published_table(
      "Table IV: ego motion on KITTI tracking",
      "Preset paper: mean over pairs of consecutive frames of E_t and E_R, no alignment. The published values "
      "are means over 12 sequences; ORB-SLAM2's is a reference, no trajectory of it is recorded here. "
      "Floor: RMS error of the truth's own steps along the way; beyond the floor: sqrt(RMSE^2 - floor^2). "
      "Lateral floor: RMS of what of the true steps goes beside the heading. Floors of E_R, RMS: at least the "
      "timing of the samples, at most the difference to the turn rates.",
      {{"sequence", "sequence", Align::left}, {"system", "system", Align::left}}, 4);
  table.columns.push_back({"Et_rmse_m", "E_t RMSE [m]", Align::right, 4});
  table.columns.push_back({"floor_m", "floor [m]", Align::right, 4});
  table.columns.push_back({"beyond_floor_m", "beyond the floor [m]", Align::right, 4});
  table.columns.push_back({"lateral_floor_m", "lateral floor [m]", Align::right, 4});
  table.columns.push_back({"ER_rmse_deg", "E_R RMSE [deg]", Align::right, 4});
  table.columns.push_back({"rotation_timing_floor_deg", "E_R floor, timing [deg]", Align::right, 4});
  table.columns.push_back({"rotation_floor_deg", "E_R floor, turn rates [deg]", Align::right, 4});
  Builder builder(table, floors_of(evidence));
  for (const char* role : {"proposed", "orb_slam2"}) {
    builder.add("12 sequences", role == std::string("proposed") ? "paper, proposed" : "ORB-SLAM2 (reference)",
                {}, &published.at(role), "the paper's own runs", "");
  }
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const auto& [system, sequences] : systems_of(*part)) {
      RecordRefs all;
      for (const auto& [sequence, records] : sequences) {
        builder.add(sequence, system, records, nullptr, frames_title(records), part->name);
        all.insert(all.end(), records.begin(), records.end());
      }
      builder.add(fmt::format("all {}", sequences.size()), system, all, nullptr,
                  fmt::format("KITTI tracking, {} sequences", sequences.size()), part->name);
    }
  }
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    for (const auto& [system, sequences] : systems_of(*part)) {
      for (const auto& [sequence, records] : sequences) {
        const Json* reference = system == "joint_flow" ? &published.at("proposed") : nullptr;
        builder.add(sequence, system, records, reference, frames_title(records), part->name);
      }
    }
  }
  return table;
}

}  // namespace sextant
