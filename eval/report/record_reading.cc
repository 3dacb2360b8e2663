#include "sextant/eval/report/record_reading.h"

#include <algorithm>
#include <map>
#include <set>

#include "sextant/base/error.h"

namespace sextant {

std::vector<double> numbers_of(const RecordRefs& records, NumberMap map, const std::string& key) {
  std::vector<double> numbers;
  for (const Record* record : records) {
    if (const auto number = find_number(record->numbers(map), key)) numbers.push_back(*number);
  }
  return numbers;
}

std::map<SeedFrame, double> errors_by_case(const RecordRefs& records, const std::string& key) {
  std::map<SeedFrame, double> errors;
  for (const Record* record : records) {
    if (const auto error = find_number(record->errors, key)) errors[{record->seed, record->frame}] = *error;
  }
  return errors;
}

std::string body_title(const std::string& body) {
  constexpr std::string_view object = "object:";
  return body == "ego" ? "camera" : "object " + body.substr(object.size());
}

constexpr int frames_per_stretch = 5;  // successive frames depend on each other

Clusters::Clusters(const RecordRefs& records) {
  std::set<uint64_t> seeds;
  for (const Record* record : records) {
    seeds.insert(record->seed);
    sequences_.try_emplace(record->sequence, sequences_.size());
  }
  n_seeds_ = static_cast<int>(seeds.size());
}

uint64_t Clusters::of(const Record& record) const {
  if (!are_frames()) return record.seed;
  return (sequences_.at(record.sequence) << 32) + static_cast<uint64_t>(record.frame / frames_per_stretch);
}

Column metric_column(const MetricDefinition& metric) {
  return {.key = metric.name, .title = metric.heading(), .decimals = metric.digits};
}

std::vector<RecordSet> record_sets(const std::vector<Record>& records) {
  std::vector<RecordSet> sets;
  const auto data_of = [](const Record& r) { return std::pair(r.dataset, r.sequence); };
  for (const auto& [data, of_set] : group_by(records_where(records, is_evaluated), data_of)) {
    const auto& [dataset, sequence] = data;
    RecordSet& set = sets.emplace_back(
        RecordSet{fmt::format("{}_{}", dataset, sequence), fmt::format("{} {}", dataset, sequence), {}});
    for (const auto& [order, of_body] : group_by(of_set, order_of))
      set.bodies.push_back({body_title(of_body.front()->body), of_body});
  }
  return sets;
}

std::vector<std::string> estimators_of(const RecordSet& set) {
  std::vector<std::string> names;
  for (const BodyRecords& body : set.bodies) {
    for (const Record* record : body.records) add_distinct(record->estimator, names);
  }
  return names;
}

RecordRefs of_estimator(const RecordRefs& records, const std::string& estimator) {
  return records_where(records, [&](const Record& record) { return record.estimator == estimator; });
}

}  // namespace sextant
