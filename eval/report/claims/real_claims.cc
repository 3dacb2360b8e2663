#include "sextant/eval/report/claims/paper_claims.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/kitti_sequence.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/report/tables/run_time.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

/// One estimated object or a difference, as records that measure_mean() reads.
ClaimResult result_of(const RecordRefs& records, const char* key, const std::string& part) {
  ClaimResult result;
  const std::optional<Measured> measured = measure_mean(records, NumberMap::errors, key);
  result.dataset = records.front()->dataset;
  result.sequence = records.front()->sequence;
  result.estimator = records.front()->estimator;
  result.value = measured->value;
  result.interval = measured->interval;
  result.records = part;
  return result;
}

/// Ours against ORB-SLAM3 over the frames of one sequence that both have.
struct Difference {
  std::string part, sequence;
  std::vector<Record> records;  ///< errors.difference_m; values.step_floor_m of the truth
  double floor_m = 0;
};

std::vector<Difference> differences_to_orb_slam(const Evidence& evidence) {
  std::map<std::pair<std::string, int>, const Record*> orb_slam;
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const Record& r : part->records) {
      if (r.estimator == "ORB-SLAM3") orb_slam[{r.sequence, r.frame}] = &r;
    }
  }
  std::vector<Difference> differences;
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    Difference difference{part->name, "", {}, 0};
    for (const Record& r : part->records) {
      if (!r.is_ego() || r.estimator != "joint_flow" || r.status != Status::ok || !r.errors.contains("Et_m"))
        continue;
      const auto other = orb_slam.find({kitti_sequence(r), r.frame});
      if (other == orb_slam.end()) continue;
      Record copy = r;
      copy.errors["difference_m"] = r.errors.at("Et_m") - other->second->errors.at("Et_m");
      difference.sequence = kitti_sequence(r);
      difference.floor_m = find_number(other->second->values, "step_floor_m").value_or(0);
      difference.records.push_back(std::move(copy));
    }
    if (!difference.records.empty()) differences.push_back(std::move(difference));
  }
  return differences;
}

RecordRefs refs(const std::vector<Record>& records) {
  RecordRefs out;
  for (const Record& record : records) out.push_back(&record);
  return out;
}

/// The interval of |x| for x in `interval`.
std::optional<Interval> absolute(const std::optional<Interval>& interval) {
  if (!interval) return std::nullopt;
  const double a = std::abs(interval->low);
  const double b = std::abs(interval->high);
  const bool has_zero = interval->low <= 0 && interval->high >= 0;
  return Interval{has_zero ? 0 : std::min(a, b), std::max(a, b)};
}

/// The published difference against the floors of all sequences of which there is a truth.
std::optional<ClaimResult> published_difference(const Evidence& evidence) {
  std::map<std::string, double> floors;
  std::string part_name;
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const Record& r : part->records) {
      const auto floor = find_number(r.values, "step_floor_m");
      if (floor) floors[r.sequence] = *floor;
    }
    part_name = part->name;
  }
  if (floors.empty() || evidence.published.empty()) return std::nullopt;
  const Json& table = evidence.published.at("tab:cam_err");
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [sequence, floor] : floors) smallest = std::min(smallest, floor);
  ClaimResult result;
  result.dataset = "kitti";
  result.sequence = fmt::format("{} sequences", floors.size());
  result.estimator = "the paper's own";
  result.subject = "ORB-SLAM2 - proposed, as published";
  result.quantity = "|difference of mean E_t| [m]";
  result.value =
      table.at("orb_slam2").at("Et_m").get<double>() - table.at("proposed").at("Et_m").get<double>();
  result.interval = Interval{result.value, result.value};
  result.stated = fmt::format("< smallest floor, {:.4f}", smallest);
  result.verdict = is_below(smallest, result.value, result.interval);
  result.records = part_name;
  return result;
}

}  // namespace

std::vector<ClaimResult> check_velocity(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    std::map<int, RecordRefs> by_object;
    for (const Record& r : part->records) {
      if (r.is_ego() || r.estimator != "joint_flow" || r.status != Status::ok || !has_truth(r)) continue;
      if (r.errors.contains("Ev_kmh")) by_object[body_order(r.body)].push_back(&r);
    }
    for (const auto& [id, records] : by_object) {
      ClaimResult result = result_of(records, "Ev_kmh", part->name);
      result.subject = fmt::format("object {}, {} pairs", id, records.size());
      result.quantity = "mean E_v [km/h]";
      result.stated = "2 .. 5";
      result.verdict = is_between(2, 5, result.value, result.interval);
      results.push_back(std::move(result));
    }
  }
  return results;
}

std::vector<ClaimResult> check_ahead_of_orb_slam(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Difference& difference : differences_to_orb_slam(evidence)) {
    ClaimResult result = result_of(refs(difference.records), "difference_m", difference.part);
    result.subject = fmt::format("camera, {} pairs of {}", difference.records.size(), difference.sequence);
    result.quantity = "mean E_t less ORB-SLAM3's [m]";
    result.stated = "< 0";
    result.verdict = is_below(0, result.value, result.interval);
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<ClaimResult> check_within_floor(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Difference& difference : differences_to_orb_slam(evidence)) {
    if (difference.floor_m <= 0) continue;
    ClaimResult result = result_of(refs(difference.records), "difference_m", difference.part);
    result.subject = fmt::format("camera, {} pairs of {}", difference.records.size(), difference.sequence);
    result.quantity = "|difference of mean E_t| to ORB-SLAM3 [m]";
    result.value = std::abs(result.value);
    result.interval = absolute(result.interval);
    result.stated = fmt::format("< floor, {:.4f}", difference.floor_m);
    result.verdict = is_below(difference.floor_m, result.value, result.interval);
    results.push_back(std::move(result));
  }
  if (auto published = published_difference(evidence)) results.push_back(std::move(*published));
  return results;
}

std::vector<ClaimResult> check_rotation_floor(const Evidence& evidence) {
  RecordRefs recorded;
  std::string part_name;
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const Record& r : part->records) {
      if (r.estimator == "ORB-SLAM3" && r.values.contains("rotation_floor_deg") && r.errors.contains("ER_deg"))
        recorded.push_back(&r);
    }
    part_name = part->name;
  }
  if (recorded.empty() || evidence.published.empty()) return {};
  const double lowest = rmse(numbers_of(recorded, NumberMap::values, "rotation_timing_floor_deg"));
  const double highest = rmse(numbers_of(recorded, NumberMap::values, "rotation_floor_deg"));
  const auto judged = [&](ClaimResult result) {
    result.quantity = "mean E_R [deg]";
    result.stated = fmt::format("floor, {:.4f} (timing) .. {:.4f} (turn rates)", lowest, highest);
    result.verdict = is_between(lowest, highest, result.value, result.interval);
    result.sequence = fmt::format("{} sequences", distinct(recorded, &Record::sequence).size());
    return result;
  };
  std::vector<ClaimResult> results;
  const Json& table = evidence.published.at("tab:cam_err");
  for (const auto& [role, name] : {std::pair{"proposed", "the paper's own"}, {"orb_slam2", "ORB-SLAM2"}}) {
    ClaimResult result;
    result.dataset = "kitti";
    result.estimator = name;
    result.subject = "camera, as published for 12 sequences";
    result.value = table.at(role).at("ER_deg").get<double>();
    result.interval = Interval{result.value, result.value};
    result.records = part_name;
    results.push_back(judged(std::move(result)));
  }
  ClaimResult ours = result_of(recorded, "ER_deg", part_name);
  ours.subject = fmt::format("camera, {} pairs", recorded.size());
  results.push_back(judged(std::move(ours)));
  return results;
}

std::vector<ClaimResult> check_frame_rate(const Evidence& evidence) {
  constexpr double ms_per_s = 1000;
  constexpr double stated_fps = 6;
  std::vector<ClaimResult> results;
  for (const RunTimes& times : run_times(evidence)) {
    const auto frame = times.by_stage.find(frame_stage);
    if (frame == times.by_stage.end()) continue;
    const auto rate = [](std::span<const double> ms) {
      double sum = 0;
      for (const double x : ms) sum += x;
      return ms_per_s * static_cast<double>(ms.size()) / sum;
    };
    ClaimResult result;
    result.dataset = times.data;
    result.estimator = times.estimator;
    result.subject = "frame";
    result.quantity = "frame pairs per second, one thread";
    result.value = rate(frame->second);
    result.interval = bootstrap(frame->second, rate);
    result.stated = ">= 6";
    result.verdict = is_above(stated_fps, result.value, result.interval);
    result.records = times.part;
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace sextant
