// Claims on real data. Intervals: bootstrap with stretches of 5 frames as clusters, because neighbouring
// frames depend on each other; frame_rate: over frames.
//
//   velocity            mean E_v of joint for each object with estimates and truth; stated as 2 .. 5 km/h
//   ahead_of_orb_slam   mean E_t of joint minus that of ORB-SLAM3's recorded trajectory, on the same frames;
//                       < 0
//   within_floor        absolute value of that difference, below the step floor of the truth; and the
//                       published difference, below the smallest step floor of the recorded sequences
//   rotation_floor      published mean E_R of both systems, and mean E_R of ORB-SLAM3's recorded
//                       trajectories; between the two RMS rotation floors of the truth of the recorded
//                       sequences (errors of timing alone, and from turn rates)
//   frame_rate          1000 / mean time of a frame in ms (table VII); stated as at least 6

#include "sextant/eval/report/claims/claim.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

/// Mean of these numbers; data set, sequence and estimator are those of the first record.
ClaimResult result_of(const std::vector<RecordNumber>& numbers, const std::string& part) {
  RecordRefs records;
  for (const RecordNumber& number : numbers) records.push_back(number.record);
  ClaimResult result{records.front()->dataset, records.front()->sequence, records.front()->estimator};
  result.set(*measure_mean(numbers, Clusters(records)));
  result.records = part;
  return result;
}

std::vector<RecordNumber> errors_of(const RecordRefs& records, const char* key) {
  std::vector<RecordNumber> numbers;
  for (const Record* record : records) numbers.push_back({record, record->errors.at(key)});
  return numbers;
}

/// E_t of the paper's method minus that of the reference system, in m, over the frames of one sequence that
/// both have.
struct Difference {
  std::string part, sequence;
  std::vector<RecordNumber> pairs;
  double floor_m = 0;  ///< floor of the truth
};

std::vector<Difference> differences_to_reference(const Evidence& evidence) {
  std::map<std::pair<std::string, int>, const Record*> reference;
  for (const EvidencePart* part : evidence.with(PartRole::recorded)) {
    for (const Record& r : part->records) {
      if (r.estimator == paper().reference.name) reference[{r.sequence, r.frame}] = &r;
    }
  }
  std::vector<Difference> differences;
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    Difference difference{part->name, "", {}, 0};
    for (const Record& r : part->records) {
      if (!r.is_ego() || r.estimator != paper().method || r.status != Status::ok ||
          !r.errors.contains("Et_m"))
        continue;
      const auto other = reference.find({paper().recorded_sequence(r), r.frame});
      if (other == reference.end()) continue;
      difference.sequence = other->second->sequence;
      difference.floor_m = find_number(other->second->values, "step_floor_m").value_or(0);
      difference.pairs.push_back({&r, r.errors.at("Et_m") - other->second->errors.at("Et_m")});
    }
    if (!difference.pairs.empty()) differences.push_back(std::move(difference));
  }
  return differences;
}

/// Interval of |x| for x in `interval`.
std::optional<Interval> absolute(const std::optional<Interval>& interval) {
  if (!interval) return std::nullopt;
  const double a = std::abs(interval->low);
  const double b = std::abs(interval->high);
  const bool has_zero = interval->low <= 0 && interval->high >= 0;
  return Interval{has_zero ? 0 : std::min(a, b), std::max(a, b)};
}

/// Compares the published difference with the smallest floor of the recorded sequences.
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
  result.dataset = paper().recorded_dataset;
  result.sequence = fmt::format("{} sequences", floors.size());
  result.estimator = "the paper's own";
  result.subject = paper().reference.title + " - proposed, as published";
  result.quantity = "|difference of mean E_t| [m]";
  result.value = std::abs(table.at(paper().reference.column).at("Et_m").get<double>() -
                          table.at("proposed").at("Et_m").get<double>());
  result.interval = Interval{result.value, result.value};
  result.stated = fmt::format("< smallest floor, {:.4f}", smallest);
  result.judge({.high = smallest});
  result.records = part_name;
  return result;
}

std::vector<ClaimResult> check_velocity(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    std::map<int, RecordRefs> by_object;
    for (const Record& r : part->records) {
      if (r.is_ego() || r.estimator != paper().method || r.status != Status::ok || !has_truth(r)) continue;
      if (r.errors.contains("Ev_kmh")) by_object[body_order(r.body)].push_back(&r);
    }
    for (const auto& [id, records] : by_object) {
      ClaimResult result = result_of(errors_of(records, "Ev_kmh"), part->name);
      result.subject = fmt::format("object {}, {} pairs", id, records.size());
      result.quantity = "mean E_v [km/h]";
      result.stated = "2 .. 5";
      result.judge({2, 5});
      results.push_back(std::move(result));
    }
  }
  return results;
}

std::vector<ClaimResult> check_ahead_of_orb_slam(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Difference& difference : differences_to_reference(evidence)) {
    ClaimResult result = result_of(difference.pairs, difference.part);
    result.subject = fmt::format("camera, {} pairs of {}", difference.pairs.size(), difference.sequence);
    result.quantity = fmt::format("mean E_t less {}'s [m]", paper().reference.name);
    result.stated = "< 0";
    result.judge({.high = 0});
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<ClaimResult> check_within_floor(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Difference& difference : differences_to_reference(evidence)) {
    if (difference.floor_m <= 0) continue;
    ClaimResult result = result_of(difference.pairs, difference.part);
    result.subject = fmt::format("camera, {} pairs of {}", difference.pairs.size(), difference.sequence);
    result.quantity = fmt::format("|difference of mean E_t| to {} [m]", paper().reference.name);
    result.value = std::abs(result.value);
    result.interval = absolute(result.interval);
    result.stated = fmt::format("< floor, {:.4f}", difference.floor_m);
    result.judge({.high = difference.floor_m});
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
      if (r.estimator == paper().reference.name && r.values.contains("rotation_floor_deg") &&
          r.errors.contains("ER_deg"))
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
    result.judge({lowest, highest});
    result.sequence = fmt::format("{} sequences", distinct(recorded, &Record::sequence).size());
    return result;
  };
  std::vector<ClaimResult> results;
  const Json& table = evidence.published.at("tab:cam_err");
  const PaperEstimator& reference = paper().reference;
  for (const auto& [column, name] : {std::pair<std::string, std::string>{"proposed", "the paper's own"},
                                     {reference.column, reference.title}}) {
    ClaimResult result;
    result.dataset = paper().recorded_dataset;
    result.estimator = name;
    result.subject = "camera, as published for 12 sequences";
    result.value = table.at(column).at("ER_deg").get<double>();
    result.interval = Interval{result.value, result.value};
    result.records = part_name;
    results.push_back(judged(std::move(result)));
  }
  ClaimResult ours = result_of(errors_of(recorded, "ER_deg"), part_name);
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
    result.judge({.low = stated_fps});
    result.records = times.part;
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace

std::vector<Claim> real_claims() {
  return {paper_claim(12, "velocity", check_velocity),
          paper_claim(13, "ahead_of_orb_slam", check_ahead_of_orb_slam),
          paper_claim(14, "within_floor", check_within_floor),
          paper_claim(15, "rotation_floor", check_rotation_floor),
          paper_claim(16, "frame_rate", check_frame_rate)};
}

}  // namespace sextant
