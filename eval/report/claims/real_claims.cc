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

/// A result on the data of a record, which is not judged yet.
ClaimResult result_on(const Record& record, const std::string& subject, const std::string& quantity,
                      const std::string& stated, const std::string& part) {
  return {.dataset = record.dataset,
          .sequence = record.sequence,
          .estimator = record.estimator,
          .subject = subject,
          .quantity = quantity,
          .stated = stated,
          .records = part};
}

IntervalEstimate mean_of(const std::vector<RecordNumber>& numbers) {
  RecordRefs records;
  for (const RecordNumber& number : numbers) records.push_back(number.record);
  return *measure_mean(numbers, Clusters(records));
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

  ClaimResult result(const std::string& quantity, const std::string& stated) const {
    const std::string subject = fmt::format("camera, {} pairs of {}", pairs.size(), sequence);
    return result_on(*pairs.front().record, subject, quantity, stated, part);
  }
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
  const double difference_m = std::abs(table.at(paper().reference.column).at("Et_m").get<double>() -
                                       table.at("proposed").at("Et_m").get<double>());
  return judged({.dataset = paper().recorded_dataset,
                 .sequence = fmt::format("{} sequences", floors.size()),
                 .estimator = "the paper's own",
                 .subject = paper().reference.title + " - proposed, as published",
                 .quantity = "|difference of mean E_t| [m]",
                 .stated = fmt::format("< smallest floor, {:.4f}", smallest),
                 .records = part_name},
                {difference_m, Interval{difference_m, difference_m}}, {.high = smallest});
}

std::vector<ClaimResult> check_velocity(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const EvidencePart* part : evidence.with(PartRole::real)) {
    const RecordRefs of_objects = records_where(part->records, [](const Record& r) {
      return !r.is_ego() && r.estimator == paper().method && is_evaluated(r) && r.errors.contains("Ev_kmh");
    });
    for (const auto& [id, records] : group_by(of_objects, order_of)) {
      const std::string subject = fmt::format("object {}, {} pairs", id, records.size());
      results.push_back(judged(result_on(*records.front(), subject, "mean E_v [km/h]", "2 .. 5", part->name),
                               mean_of(errors_of(records, "Ev_kmh")), {2, 5}));
    }
  }
  return results;
}

std::vector<ClaimResult> check_ahead_of_orb_slam(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Difference& difference : differences_to_reference(evidence)) {
    const std::string quantity = fmt::format("mean E_t less {}'s [m]", paper().reference.name);
    results.push_back(judged(difference.result(quantity, "< 0"), mean_of(difference.pairs), {.high = 0}));
  }
  return results;
}

std::vector<ClaimResult> check_within_floor(const Evidence& evidence) {
  std::vector<ClaimResult> results;
  for (const Difference& difference : differences_to_reference(evidence)) {
    if (difference.floor_m <= 0) continue;
    const std::string quantity = fmt::format("|difference of mean E_t| to {} [m]", paper().reference.name);
    const IntervalEstimate mean = mean_of(difference.pairs);
    results.push_back(judged(difference.result(quantity, fmt::format("< floor, {:.4f}", difference.floor_m)),
                             {std::abs(mean.value), absolute(mean.interval)}, {.high = difference.floor_m}));
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
  std::vector<ClaimResult> results;
  const auto add = [&](const std::string& dataset, const std::string& estimator, const std::string& subject,
                       const IntervalEstimate& mean) {
    results.push_back(
        judged({.dataset = dataset,
                .sequence = fmt::format("{} sequences", distinct(recorded, &Record::sequence).size()),
                .estimator = estimator,
                .subject = subject,
                .quantity = "mean E_R [deg]",
                .stated = fmt::format("floor, {:.4f} (timing) .. {:.4f} (turn rates)", lowest, highest),
                .records = part_name},
               mean, {lowest, highest}));
  };
  const Json& table = evidence.published.at("tab:cam_err");
  const PaperEstimator& reference = paper().reference;
  for (const auto& [column, name] : {std::pair<std::string, std::string>{"proposed", "the paper's own"},
                                     {reference.column, reference.title}}) {
    const double ER_deg = table.at(column).at("ER_deg").get<double>();
    add(paper().recorded_dataset, name, "camera, as published for 12 sequences",
        {ER_deg, Interval{ER_deg, ER_deg}});
  }
  const Record& first = *recorded.front();
  add(first.dataset, first.estimator, fmt::format("camera, {} pairs", recorded.size()),
      mean_of(errors_of(recorded, "ER_deg")));
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
    results.push_back(judged({.dataset = times.data,
                              .estimator = times.estimator,
                              .subject = "frame",
                              .quantity = "frame pairs per second, one thread",
                              .stated = ">= 6",
                              .records = times.part},
                             {rate(frame->second), bootstrap(frame->second, rate)}, {.low = stated_fps}));
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
